// Records a video of one turn round the model; the window's thread draws and shows it.
#pragma once

#include "viewer/navigation/camera_control.h"
#include "viewer/pictures/video_writer.h"
#include "viewer/scene/shown_model.h"

#include <glm/gtc/constants.hpp>

#include <utility>

namespace pbm {

class Recording {
  public:
    // Starts at `first`; one turn round its focal point, every frame at full detail.
    Recording(VideoSink sink, const VideoOptions &video, const ViewOptions &view, const Camera &first, glm::dvec3 axis)
        : video_(video), view_(view), first_(first), axis_(axis),
          recorder_(std::move(sink), view.resolution, false, view.load.threads, view.load.max_memory) {}

    bool done() const { return frame_ == video_.frames; }
    int frame() const { return frame_; } // drawn so far
    const VideoOptions &video() const { return video_; }
    // Of the next frame.
    Camera camera() const { return turntable(first_, axis_, glm::two_pi<double>() * frame_ / video_.frames); }
    // Draws the next frame, waiting for all that it needs; passes it to `show`, then to the video.
    //
    // errors  as StreamedModel::load and the sink
    Status add(ShownModel &model, const LookPointer &look,
               const std::function<void(const Framebuffer &, const PictureStatistics &)> &show) {
        const DetailView view =
            model.view(camera(), view_.resolution, max_error_of(view_, look->options.quality, Motion::moving));
        const auto detail = model.streamed().load(view);
        if (!detail)
            return detail.error();
        const PictureStatistics drawn = model.draw_frame(*detail, view, look, recorder_.canvas());
        show(recorder_.canvas(), drawn);
        ++frame_;
        return recorder_.add();
    }
    // Waits until all frames are written. Must be the last call.
    Status finish() { return recorder_.finish(); }

  private:
    const VideoOptions video_;
    const ViewOptions view_;
    const Camera first_;
    const glm::dvec3 axis_;
    VideoRecorder recorder_;
    int frame_ = 0;
};

} // namespace pbm
