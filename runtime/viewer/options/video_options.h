// The part of a command line that asks for a video; pbm-render and pbm-view share it.
#pragma once

#include "command_line/command_line.h"
#include "viewer/options/view_options.h"
#include "viewer/pictures/video_writer.h"

#include <string>

namespace pbm {

struct VideoChoice {
    VideoOptions video;
    bool avi = false; // without a name of its own
};

// The dissertation's switch.
inline constexpr command_line::OldSwitch kOldVideoSwitch{"-AVI", "--avi"};

// Declares --turntable, --avi, --frames, --fps and --video-quality. `choice` must outlive the parsing.
void add_video_options(command_line::CommandLine &line, VideoChoice &choice);

// To be asked after parsing: fills in the name that --avi stands for, that of the model in the present folder.
//
// errors  usage  an unknown form, two videos, no transparency in this form
Status complete_video(VideoChoice &choice, const std::string &model, const RenderOptions &render);

} // namespace pbm
