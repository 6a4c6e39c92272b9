// A video once round the model, drawn and shown by the window's thread.
#pragma once

#include "viewer/pictures/video_writer.h"
#include "viewer/scene/shown_model.h"

namespace pbm {

class Recording {
  public:
    // Starts at `first`, once round its focal point, every frame exact.
    Recording(VideoSink sink, const VideoOptions &video, const ViewOptions &view, const Camera &first, glm::dvec3 axis);

    bool done() const { return frame_ == video_.frames; }
    int frame() const { return frame_; } // drawn so far
    const VideoOptions &video() const { return video_; }
    // Of the next frame.
    Camera camera() const;
    // Draws the next frame, waiting for all that it needs, and lets it be written; `show` gets to see it before.
    //
    // errors  as StreamedModel::load and the sink
    Status add(ShownModel &model, const LookPointer &look,
               const std::function<void(const Framebuffer &, const PictureStatistics &)> &show);
    // Waits until all is written. The last call.
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
