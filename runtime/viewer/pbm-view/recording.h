// Records a video of one turn round the model; the window's thread draws and shows it.
#pragma once

#include "viewer/pictures/video_writer.h"
#include "viewer/scene/shown_model.h"

namespace pbm {

class Recording {
  public:
    // Starts at `first`; one turn round its focal point, every frame at full detail.
    Recording(VideoSink sink, const VideoOptions &video, const ViewOptions &view, const Camera &first, glm::dvec3 axis);

    bool done() const { return frame_ == video_.frames; }
    int frame() const { return frame_; } // drawn so far
    const VideoOptions &video() const { return video_; }
    Camera camera() const; // of the next frame
    // Draws the next frame, waiting for all that it needs; passes it to `show`, then to the video.
    //
    // errors  as StreamedModel::load and the sink
    Status add(ShownModel &model, const LookPointer &look,
               const std::function<void(const Framebuffer &, const PictureStatistics &)> &show);
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
