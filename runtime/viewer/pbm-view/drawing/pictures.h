// Draws the pictures of what is shown: fast ones at once or in the background as FrameScheduler says, refined ones once
// the view rests. Saves them.
#pragma once

#include "viewer/pbm-view/drawing/refinement.h"
#include "viewer/pbm-view/drawing/shown.h"
#include "viewer/pbm-view/measure/polyline.h"
#include "viewer/pbm-view/window/notices.h"
#include "viewer/pbm-view/window/presenter.h"

#include "viewer/scene/frame_scheduler.h"
#include "viewer/scene/picture_saver.h"

#include <functional>
#include <future>
#include <memory>
#include <optional>

namespace pbm {

class Pictures {
  public:
    // All outlive it. `min_fps`: of a moving view. `lost`: called when a file turns out to be written in place.
    Pictures(Shown &shown, Notices &notices, Window &window, ThreadPool &background, double min_fps,
             std::function<void()> lost)
        : shown_(shown), notices_(notices), window_(window), background_(background), min_fps_(min_fps),
          lost_(std::move(lost)), saver_(background) {}

    // Another model is shown: forgets the picture.
    void show_model();
    // The camera, the look or the size has changed.
    void change_view();
    // Shadows have changed. The picture without them stays until one with them has full detail.
    void restyle();
    // Discards what is being drawn: the picture shown stays.
    void hold();

    // Takes, between two events, what was loaded, drawn and saved.
    void receive();
    // Draws what is due of a picture of `size`; 0 x 0: nothing.
    void draw(glm::ivec2 size);
    // When `draw` has something to do; absent: not before something is received.
    std::optional<double> due(glm::ivec2 size) const;
    // Saves the view at full detail, whatever is shown at the moment.
    void save();
    // Reports pictures that were saved or failed. `all`: waits for those not yet done.
    void receive_saves(bool all);
    // Shows a frame of a video.
    void show_frame(const Framebuffer &pixels, const PictureStatistics &drawn);

    // Whether there is a picture of the present view, and whether it has full detail.
    bool is_shown() const { return scheduler_ && scheduler_->shown(); }
    bool is_exact() const { return scheduler_ && scheduler_->complete(); }
    // When the view changed last, by the window's clock; absent for the first view of a model.
    std::optional<double> changed() const { return scheduler_ ? scheduler_->changed() : std::nullopt; }
    // Of the picture shown.
    const PictureStatistics &drawn() const { return drawn_; }
    const Camera &camera() const { return camera_; }
    int samples() const { return samples_; } // 0: it is not fine
    // The point that it shows at this pixel.
    std::optional<MeasuredPoint> pick(glm::dvec2 pixel) const;
    const Presenter &presenter() const { return presenter_; }

  private:
    // A picture drawn in the background, and its view.
    struct Picture {
        std::uint64_t view;
        double max_error;
        Framebuffer pixels;
        PictureStatistics drawn;
    };
    void draw_due(glm::ivec2 size);
    void draw_now(const DetailView &view);
    bool show_first();
    void show_at_once(double max_error, const PictureStatistics &drawn);
    void draw_in_background(const DetailView &view);
    void receive_picture();
    void refine();
    std::optional<double> refinement_due() const;
    bool is_refining() const { return refinement_ && samples_ == 0; } // the first fine picture is being drawn
    void replace_canvas(Framebuffer picture);
    void end_refinement();
    void show_picture(double max_error, const PictureStatistics &drawn);
    DetailView view_at(double max_error) const;
    FrameScheduler::Errors errors() const; // of pictures with the present look
    Detail choose(const DetailView &view);
    void check_room();

    Shown &shown_;
    Notices &notices_;
    Window &window_;
    ThreadPool &background_;
    const double min_fps_;
    const std::function<void()> lost_;
    Presenter presenter_;
    std::optional<FrameScheduler> scheduler_; // while there is a model
    std::uint64_t view_ = 0;                  // counts changes of model, camera, look and size
    std::optional<Framebuffer> canvas_;       // the picture shown; of the present model
    const std::shared_ptr<PictureMemory> memory_ = std::make_shared<PictureMemory>();
    Camera camera_; // that it shows
    PictureStatistics drawn_;
    int samples_ = 0;
    std::future<Picture> drawing_;
    std::unique_ptr<Refinement> refinement_; // of the current view
    bool waits_for_chunks_ = false;          // the refinement that is due
    std::uint64_t full_view_ = 0;            // the view for which memory ran out
    bool has_reported_memory_ = false;       // has reported that memory is too small
    PictureSaver saver_;
};

} // namespace pbm
