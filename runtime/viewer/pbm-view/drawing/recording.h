// Records a video of one turn round the model; the window's thread draws and shows it.
#pragma once

#include "viewer/pbm-view/drawing/shown.h"

#include "viewer/navigation/camera_control.h"
#include "viewer/pictures/video_writer.h"

#include <glm/gtc/constants.hpp>

#include <functional>
#include <optional>
#include <utility>

namespace pbm {

class Recording {
  public:
    // `shown` outlives it; its flags is_for_video and is_recorded are set as long as this exists and records.
    Recording(Shown &shown, VideoSink sink, const VideoOptions &video)
        : shown_(shown), sink_(std::move(sink)), video_(video) {
        shown_.is_for_video = true;
    }
    ~Recording() { shown_.is_for_video = shown_.is_recorded = false; }

    // Starts at the present camera; one turn round its focal point, every frame at full detail.
    void begin() {
        first_ = shown_.camera;
        const ViewOptions &options = shown_.options;
        recorder_.emplace(std::move(sink_), options.resolution, false, options.load.threads, options.load.max_memory);
        shown_.is_recorded = true;
    }
    bool done() const { return frame_ == video_.frames; }
    int frame() const { return frame_; } // drawn so far
    const VideoOptions &video() const { return video_; }
    // Of the next frame.
    Camera camera() const {
        return turntable(first_, up_direction(shown_.up()), glm::two_pi<double>() * frame_ / video_.frames);
    }
    // Draws the next frame, waiting for all that it needs; passes it to `show`, then to the video.
    //
    // errors  as StreamedModel::load and the sink
    Status add(const std::function<void(const Framebuffer &, const PictureStatistics &)> &show) {
        ShownModel &model = *shown_.model;
        const glm::ivec2 size = shown_.options.resolution;
        const double max_error = max_error_of(shown_.options, size, shown_.look->options.quality, Motion::moving);
        const DetailView view = model.view(camera(), size, max_error);
        const auto detail = model.streamed().load(view);
        if (!detail)
            return detail.error();
        const PictureStatistics drawn = model.draw_frame(*detail, view, shown_.look, recorder_->canvas());
        show(recorder_->canvas(), drawn);
        ++frame_;
        return recorder_->add();
    }
    // Waits until all frames are written. Must be the last call.
    Status finish() { return recorder_->finish(); }

  private:
    Shown &shown_;
    VideoSink sink_; // until the recording begins
    const VideoOptions video_;
    Camera first_;
    std::optional<VideoRecorder> recorder_;
    int frame_ = 0;
};

} // namespace pbm
