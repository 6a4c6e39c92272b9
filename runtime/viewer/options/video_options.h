// Command-line options for videos, shared by pbm-render and pbm-view.
#pragma once

#include "command_line/command_line.h"
#include "viewer/options/view_options.h"
#include "viewer/pictures/frame_names.h"
#include "viewer/pictures/video_writer.h"

#include <optional>
#include <string>
#include <vector>

namespace pbm {

struct VideoChoice {
    VideoOptions video;
    bool avi = false;                 // --avi was given
    std::optional<FrameRange> part{}; // of a sequence: --frames FIRST-LAST
};

// The dissertation's switch for --avi.
inline constexpr command_line::OldSwitch kOldVideoSwitch{"-AVI", "--avi"};

// Declares --turntable, --avi, --frames, --fps and --video-quality. `choice` must outlive the parsing.
void add_video_options(command_line::CommandLine &line, VideoChoice &choice);

// Call after parsing. Derives the name for --avi: that of the model, in the current folder.
//
// errors  usage  unknown video format, two videos, a part of one, or a format without the transparency asked for
Status complete_video(VideoChoice &choice, const std::string &model, const RenderOptions &render);

// The files of a video, for command_line::refuse_outputs.
std::vector<command_line::OutputFile> video_outputs(const VideoOptions &video);

} // namespace pbm
