// Records a video of one turn around a model.
#pragma once

#include "model_drawer.h"

#include "viewer/pictures/video_writer.h"

#include <functional>

namespace pbm {

// The outcome of a recording: if there is no video, one of the two failed.
struct RecordedVideo {
    Status model, file;      // as ModelDrawer::load and the sink
    std::uint64_t bytes = 0; // of the file, or of all frames
    double ms = 0;
};

// Draws the frames that `video` asks for and hands them to `recorder`. The first one is what `first` sees; before each
// frame, 0.., the function calls `begun`.
RecordedVideo record_turntable(ModelDrawer &drawer, VideoRecorder &recorder, const VideoOptions &video,
                               const Camera &first, const std::function<void(int frame, const Camera &)> &begun);

} // namespace pbm
