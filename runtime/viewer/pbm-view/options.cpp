#include "options.h"

#include "command_line/parse.h"
#include "viewer/option_values.h"

#include <array>
#include <map>

namespace pbm {
namespace {

constexpr std::array<command_line::OldSwitch, 2> kOldSwitches{
    {{"-IGNORE_POINT_COLOURS", "--ignore-point-colours"}, {"-FLYING_CAMERA", "--camera-mode=fly"}}};

} // namespace

std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Shows a binary voxel grid (.bvg) in a window.\nF1 tells the keys, Escape quits.",
                 std::string(program)};
    app.add_option("FILE", arguments.input, "Model to show; default: the sample");
    const std::map<std::string, CameraMode> modes{{"orbit", CameraMode::orbit}, {"fly", CameraMode::fly}};
    app.option_defaults()->group("Camera");
    app.add_option_function<std::string>(
           "--camera-mode", [&](const std::string &mode) { arguments.camera_mode = modes.at(mode); },
           "orbit (default): the mouse turns the model; fly: it turns the camera, keys move it")
        ->type_name("orbit|fly")
        ->check([&](const std::string &mode) {
            return modes.count(mode) != 0 ? std::string() : "'" + mode + "' is no camera mode; write orbit or fly";
        });
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
    add_view_options(app, arguments.view);
    app.set_version_flag("-V,--version", std::string(program) + " " PBM_VERSION);
    return command_line::parse(
        app, program, argc, argv, kOldSwitches,
        {.most_used = {"--camera-mode", "--resolution", "--show-frame-time", "--help"},
         .examples = {{"pbm-view scan.bvg", "The model in a window; drag it, Space saves a picture."},
                      {"pbm-view scan.bvg --camera-mode fly", "Through the model; the arrow keys fly."}},
         .run_time_limits = "no display or OpenGL"});
}

} // namespace pbm
