// Records a video of one turn around a model.
#pragma once

#include "model_drawer.h"

#include "viewer/pictures/video_writer.h"

#include <functional>

namespace pbm {

// The outcome of a recording. There is no video if one of the two failed.
struct RecordedVideo {
    Status model, file;      // errors of ModelDrawer::load and of the sink
    std::uint64_t bytes = 0; // of the file, or of all frames
    double ms = 0;
};

// Draws the frames of `video` and passes them to `recorder`. The first one is seen from `first`. Calls `begun` before
// each frame, numbered from 0.
RecordedVideo record_turntable(ModelDrawer &drawer, VideoRecorder &recorder, const VideoOptions &video,
                               const Camera &first, const std::function<void(int frame, const Camera &)> &begun);

} // namespace pbm
