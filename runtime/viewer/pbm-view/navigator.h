// Moves the camera: by input, and in glides to known views and to what was clicked.
#pragma once

#include "viewer/pbm-view/drawing/pictures.h"

#include "viewer/navigation/camera_control.h"
#include "viewer/navigation/camera_glide.h"
#include "viewer/navigation/saved_views.h"
#include "viewer/navigation/standard_views.h"

#include <optional>

namespace pbm {

class Navigator {
  public:
    // All outlive it.
    Navigator(Shown &shown, Pictures &pictures, Notices &notices, CameraMode mode)
        : shown_(shown), pictures_(pictures), notices_(notices), view_angle_(shown.options.view_angle), mode_(mode) {}

    // The default camera for a picture of `size`; for the last size if that is 0 x 0.
    Result<Camera> first_camera(const ShownModel &model, glm::ivec2 size) const;
    // Starts anew with another model: at the view of its file if there is one and no option names another, else at
    // `first`; absent: stays.
    void show_model(const std::optional<Camera> &first, const std::optional<SavedView> &of_file);
    // Ends a glide, and goes back to the camera of the picture shown.
    void hold();

    // Moves the camera, and ends a glide.
    void move_to(const Camera &camera);
    void set_clip(const ClipRegion &clip);
    void drag(Drag drag, glm::dvec2 offset); // right, up; picture heights
    // Keeps what the picture shows at this pixel, `seen`, where it is.
    void zoom(double notches, glm::dvec2 pixel, const std::optional<MeasuredPoint> &seen);
    void press(Arrow arrow, bool pressed);
    void glide_to(const Camera &camera);
    // Goes back to the first view of a picture of `size`.
    void reset(glm::ivec2 size);
    // 1 to 4: from the front, the right, above, a corner; 5: orthographic or perspective; 6 to 9: as it was saved.
    void choose_view(int number);
    void save_view(int number); // 6 to 9
    // Shows the whole model from where the camera stands.
    void fit();
    // Makes the next axis point up, in the order y, z, x, and goes back to the first view. Default lights turn with it.
    void turn_up_axis(glm::ivec2 size);
    // Shows or hides backs, whatever the file says of its surface.
    void switch_backs();
    void switch_mode();

    // Takes the steps that are due of held arrow keys and of a glide.
    void follow();
    // When `follow` has something to do next, window's clock; absent while nothing moves.
    std::optional<double> due(double now) const;
    bool is_gliding() const { return glide_.has_value(); }
    CameraMode mode() const { return mode_; }

  private:
    void look_from(StandardView view);
    void toggle_projection();
    void recall_view(int number);
    void set_camera(const Camera &camera);
    Steering steering() const { return {mode_, axis_, shown_.model->bounds()}; }

    Shown &shown_;
    Pictures &pictures_;
    Notices &notices_;
    const double view_angle_;  // of the command line, degrees
    glm::dvec3 axis_{0, 1, 0}; // that the camera turns about
    CameraMode mode_;
    HeldArrows arrows_;
    std::optional<CameraGlide> glide_; // sets the camera until its end
    struct ZoomAnchor {
        glm::dvec2 pixel;
        Camera camera; // after the last zoom
        glm::dvec3 point;
    };
    std::optional<ZoomAnchor> anchor_; // holds while the mouse and the camera stay
    const SavedViews saved_views_;
};

} // namespace pbm
