// A video once round a model.
#pragma once

#include "model_drawer.h"

#include "viewer/pictures/video_writer.h"

#include <functional>

namespace pbm {

// What became of a video; one of both failed if it was not made.
struct RecordedVideo {
    Status model, file;      // as ModelDrawer::load and the sink
    std::uint64_t bytes = 0; // of the file, or of all frames
    double ms = 0;
};

// Draws and writes what `video` asks for into `sink`, starting at `first`; `begun` is called before each frame, 0.. .
RecordedVideo record_turntable(ModelDrawer &drawer, VideoSink sink, const VideoOptions &video, const ViewOptions &view,
                               const Camera &first, const std::function<void(int frame, const Camera &)> &begun);

} // namespace pbm
