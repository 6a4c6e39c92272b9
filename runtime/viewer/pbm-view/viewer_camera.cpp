// Moves the camera: glides to known views, to what was clicked, and zooms to the mouse.
#include "viewer.h"

#include "pbm_render/camera/unit_grid.h"

#include <glm/geometric.hpp>

namespace pbm {

void Viewer::glide_to(const Camera &camera) {
    if (!model_ || recording_ || !is_usable(camera))
        return;
    if (video_) // its first picture is about to be drawn
        return move_to(camera);
    glide_.emplace(camera_, camera, Window::now());
}

void Viewer::follow_glide() {
    if (!glide_)
        return;
    const double now = Window::now();
    set_camera(glide_->at(now));
    if (glide_->is_done(now))
        glide_.reset();
}

void Viewer::look_from(StandardView view) {
    if (!model_ || view_size_ == glm::ivec2(0))
        return;
    const Camera from = standard_view(view, up_of(options_, model_->grid()), camera_, model_->bounds(), view_size_);
    glide_to(framed(from, model_->extent(), view_size_.x, view_size_.y));
}

// Shows the whole model from where the camera stands.
void Viewer::fit() {
    if (model_ && view_size_ != glm::ivec2(0))
        glide_to(framed(camera_, model_->extent(), view_size_.x, view_size_.y));
}

void Viewer::toggle_projection() {
    if (!model_)
        return;
    Camera camera = camera_;
    camera.orthographic = !camera.orthographic;
    options_.orthographic = camera.orthographic;
    move_to(camera);
    notify(camera.orthographic ? "Orthographic" : "Perspective", false);
}

// Shows or hides backs, whatever the file says of its surface.
void Viewer::switch_backs() {
    if (!model_)
        return;
    Camera camera = camera_;
    camera.backs = shows_backs(camera_, model_->parameters()) ? Backs::hide : Backs::show;
    options_.backs = camera.backs;
    move_to(camera);
    notify(camera.backs == Backs::show ? "Backs are shown" : "Backs are hidden: B shows them", false);
}

void Viewer::save_view(int number) {
    if (!model_)
        return;
    const Status saved = saved_views_.save(model_->path(), number, {camera_, options_.view_angle});
    const std::string digit = std::to_string(number);
    notify(saved ? "Saved this view: " + digit + " shows it" : "View " + digit + ": " + saved.error().message, !saved);
}

void Viewer::recall_view(int number) {
    if (!model_)
        return;
    const auto view = saved_views_.find(model_->path(), number);
    if (!view) {
        const std::string digit = std::to_string(number);
        return notify("There is no view " + digit + " of this model yet: Ctrl + " + digit + " saves one", false);
    }
    options_.view_angle = view->view_angle;
    options_.orthographic = view->camera.orthographic;
    options_.clip = view->camera.clip;
    options_.backs = view->camera.backs;
    glide_to(view->camera);
}

// Moves what is under the mouse to the middle of the picture.
void Viewer::focus() {
    if (const auto point = pick_under_mouse())
        glide_to(focused(camera_, point->place));
}

void Viewer::zoom(double notches) {
    if (!model_ || view_size_ == glm::ivec2(0))
        return;
    const glm::dvec2 mouse = mouse_pixel();
    if (!anchor_ || anchor_->mouse != mouse || anchor_->camera != camera_) {
        // The point of the surface, or else of the focal point's plane, that the camera sees under the mouse. The
        // picture may show an earlier camera: its depth is a guess then.
        const PictureSpace space = space_of(camera_);
        const auto seen = pick_under_mouse();
        const double depth = seen ? space.place(seen->place).depth : 0;
        anchor_ = {mouse, camera_, space.point(mouse, depth > 0 ? depth : space.focal_depth())};
    }
    move_to(after_wheel(camera_, steering(), notches, anchor_->point));
    anchor_->camera = camera_;
}

} // namespace pbm
