// Numbered pictures of a camera that moves.
#pragma once

#include "command_line/progress_display.h"
#include "model_drawer.h"
#include "viewer/cameras/camera_path.h"
#include "viewer/options/view_options.h"
#include "viewer/pictures/frame_names.h"
#include "viewer/pictures/picture_file.h"

#include <cstdint>
#include <ostream>

namespace pbm {

struct Sequence {
    CameraPath path;
    double fps;
    FrameRange frames; // that are drawn
    FrameNames names;
    PictureForm form;
    bool resume = false; // keeps files that are there: they are whole, since files are replaced atomically
};

struct SequenceStatistics {
    int drawn = 0, kept = 0;
    std::uint64_t bytes = 0; // of the frames that were drawn
    double ms = 0;
};

// Draws each frame as a picture of its own, which depends on no other one, and writes it before the next one. Errors
// name the frame. `views`: gets the options of each view; may be null.
Result<SequenceStatistics> draw_sequence(const Sequence &sequence, const ViewOptions &view, ModelDrawer &drawer,
                                         command_line::ProgressDisplay &progress, std::ostream *views);

// What is wrong with a camera of a file that choose_camera refuses.
Error flat_camera();

// Draws a picture that was loaded, and returns it as the bytes of a file.
Result<Bytes> draw_file(ModelDrawer &drawer, const Camera &camera, const ViewOptions &view, PictureForm form);

} // namespace pbm
