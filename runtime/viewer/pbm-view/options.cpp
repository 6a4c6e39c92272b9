#include "options.h"

#include "command_line/common_options.h"
#include "viewer/options/option_values.h"

#include <algorithm>

namespace pbm {
std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    command_line::CommandLine line{std::string(program),
                                   "Shows a binary voxel grid (.pbvg) in a window.\nF1 lists the keys, Escape quits."};
    line.add("FILE", "Models, scans or folders to show; default: the sample", &arguments.inputs);
    line.topic = "Camera";
    command_line::add_choice<CameraMode>(
        line, "--camera-mode", "camera mode", {{"orbit", CameraMode::orbit}, {"fly", CameraMode::fly}},
        arguments.camera_mode, "orbit (default): the mouse turns the model; fly: it turns the camera, keys move it");
    line.topic = "Look";
    line.add("--min-fps",
             "Frames per second that a moving view keeps, with larger voxels where it must; default 30; 0: "
             "never coarser",
             command_line::stored(parse_frame_rate, arguments.min_fps), {.type = "N"});
    line.add("--show-frame-time", "Show what a picture costs; F2 does too", &arguments.show_frame_time);
    line.add("--panel", "Show the panel of the shading; Tab does too", &arguments.show_panel);
    command_line::add_choice<Theme>(
        line, "--theme", "theme", {{"desktop", Theme::desktop}, {"dark", Theme::dark}, {"light", Theme::light}},
        arguments.theme, "Of panel and texts: desktop (default), dark where it says nothing; dark; light");
    add_view_options(line, arguments.view);
    add_scan_options(line, arguments.scans);
    add_video_options(line, arguments.choice);
    line.add_version(PBM_VERSION);
    if (const auto done = command_line::parse(
            line, argc, argv, old_switches({kOldVideoSwitch, {"-FLYING_CAMERA", "--camera-mode=fly"}}),
            {.most_used = {"--camera-mode", "--resolution", "--show-frame-time", "--help"},
             .examples = {{"pbm-view scan.pbvg", "The model in a window; drag it, Space saves a picture."},
                          {"pbm-view scans/", "A folder of models and scans; Page Up and Page Down turn its pages."},
                          {"pbm-view scan.pbvg --camera-mode fly", "Through the model; the arrow keys fly."}},
             .run_time_limits = "no display or OpenGL"}))
        return done;
    arguments.scales_window = std::none_of(line.given.begin(), line.given.end(),
                                           [](const auto &option) { return option.name == "--resolution"; });
    if (const Status known = complete_video(arguments.choice, arguments.inputs.empty() ? "" : arguments.inputs.front(),
                                            arguments.view.look.render);
        !known)
        return command_line::fail_usage(program, known.error().message);
    if (!arguments.choice.video.output.empty() && arguments.inputs.size() > 1)
        return command_line::fail_usage(program, "a video is of one model; name one FILE");
    if (arguments.choice.video.output == "-")
        return command_line::fail_usage(program, "raw frames are written by pbm-render --turntable -; name a file");
    return std::nullopt;
}

} // namespace pbm
