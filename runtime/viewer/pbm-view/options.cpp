#include "options.h"

#include "command_line/common_options.h"
#include "viewer/options/option_values.h"

namespace pbm {
std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Shows a binary voxel grid (.bvg) in a window.\nF1 tells the keys, Escape quits.",
                 std::string(program)};
    app.add_option("FILE", arguments.input, "Model to show; default: the sample");
    app.option_defaults()->group("Camera");
    command_line::add_choice<CameraMode>(
        app, "--camera-mode", "camera mode", {{"orbit", CameraMode::orbit}, {"fly", CameraMode::fly}},
        arguments.camera_mode, "orbit (default): the mouse turns the model; fly: it turns the camera, keys move it");
    app.option_defaults()->group("Look");
    app.add_option_function<std::string>(
           "--min-fps",
           [&](const std::string &text) {
               const auto fps = parse_frame_rate(text);
               if (!fps)
                   throw CLI::ValidationError(fps.error().message);
               arguments.min_fps = *fps;
           },
           "Frames per second that a moving view keeps, with larger voxels where it must; default 30; 0: never coarser")
        ->type_name("N");
    app.add_flag("--show-frame-time", arguments.show_frame_time, "Show what a picture costs; F2 does too");
    app.add_flag("--panel", arguments.show_panel, "Show the panel of the shading; Tab does too");
    add_view_options(app, arguments.view);
    add_video_options(app, arguments.choice);
    app.set_version_flag("-V,--version", std::string(program) + " " PBM_VERSION);
    if (const auto done = command_line::parse(
            app, program, argc, argv, old_switches({kOldVideoSwitch, {"-FLYING_CAMERA", "--camera-mode=fly"}}),
            {.most_used = {"--camera-mode", "--resolution", "--show-frame-time", "--help"},
             .examples = {{"pbm-view scan.bvg", "The model in a window; drag it, Space saves a picture."},
                          {"pbm-view scan.bvg --camera-mode fly", "Through the model; the arrow keys fly."}},
             .run_time_limits = "no display or OpenGL"}))
        return done;
    if (const Status known = complete_video(arguments.choice, arguments.input, arguments.view.look.render); !known)
        return command_line::fail_usage(program, known.error().message);
    if (arguments.choice.video.output == "-")
        return command_line::fail_usage(program, "raw frames are written by pbm-render --turntable -; name a file");
    return std::nullopt;
}

} // namespace pbm
