// What a command line asks of pbm-render.
#pragma once

#include "command_line/common_options.h"
#include "sequence.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/options/preset.h"
#include "viewer/options/video_options.h"
#include "viewer/options/view_options.h"
#include "viewer/pictures/picture_file.h"

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

inline constexpr std::string_view kProgram = "pbm-render";

struct RenderArguments {
    std::string input, output, depth_output;
    std::string page; // folder
    std::string page_language = "en", page_url;
    std::string json; // file, "-" for stdout, empty for none
    ViewOptions view;
    ScanOptions scans;
    VideoChoice choice;
    int bench = 0;     // frames
    int thumbnail = 0; // largest width and height, pixels; 0: a picture of any size
    std::optional<Preset> preset;
    std::string camera_file;
    std::optional<CameraPath> path;   // of this file
    std::optional<Sequence> sequence; // in place of one picture
    bool resume = false;
    std::set<std::string> given; // names of options

    Result<PictureForm> form() const { return thumbnail > 0 ? PictureForm::png : picture_form(output); }
    const VideoOptions &video() const { return choice.video; }
    bool wants_output() const { return !output.empty() && !sequence; }
    bool wants_still() const { return wants_output() || !depth_output.empty() || !page.empty(); }
    bool wants_picture() const { return wants_still() || bench > 0; }
    bool wants_layers() const {
        const auto known = form();
        return wants_output() && known && *known == PictureForm::exr;
    }
    bool wants_flat_picture() const {
        return (wants_output() && !wants_layers()) || !depth_output.empty() || !page.empty() || bench > 0;
    }
    Motion motion() const { return wants_still() ? Motion::still : Motion::moving; } // of the picture
    LookOptions frame_look() const { return look_of(Motion::moving, view.look); }
    LookOptions picture_look() const { return look_of(motion(), view.look); }
    std::vector<command_line::OutputFile> outputs() const {
        std::vector<command_line::OutputFile> files = video_outputs(video());
        const auto [first, last] = sequence ? sequence->frames : FrameRange{1, 1};
        files.push_back({"--output", sequence ? sequence->names.of(first) : output});
        if (last > first)
            files.push_back({"--output", sequence->names.of(last)});
        files.insert(files.end(), {{"--depth-output", depth_output}, {"--json", json}});
        return files;
    }
};

// Reports the mistake in the command line. Returns the exit code.
int fail_usage(const std::string &message);

// Fills `arguments`, or returns the exit code if the program is done.
std::optional<int> parse(int argc, char **argv, RenderArguments &arguments);

} // namespace pbm
