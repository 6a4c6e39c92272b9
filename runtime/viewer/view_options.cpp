#include "viewer/view_options.h"

#include "command_line/common_options.h"
#include "viewer/option_values.h"

#include <glm/trigonometric.hpp>

#include <algorithm>
#include <array>
#include <charconv>

namespace pbm {
namespace {

// Stores what `parse` makes of an option's text.
template <class Parse, class Target> auto stored(Parse parse, Target &target) {
    return [parse, &target](const std::string &text) {
        auto value = parse(text);
        if (!value)
            throw CLI::ValidationError(value.error().message);
        target = *value;
    };
}

// Shortest text that reads back as the same number.
std::string number_text(double number) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
    return {text.data(), end};
}

std::string vector_text(const glm::dvec3 &v) {
    return number_text(v.x) + "," + number_text(v.y) + "," + number_text(v.z);
}

} // namespace

void add_view_options(CLI::App &app, ViewOptions &options) {
    const auto text_option = [&](const std::string &names, const char *type, auto store, const std::string &help) {
        app.add_option_function<std::string>(names, store, help)->type_name(type);
    };
    text_option("--resolution", "W,H", stored(parse_resolution, options.resolution),
                "Size of the picture; default 1280,720");
    app.option_defaults()->group("Camera");
    text_option("--camera-position", "X,Y,Z", stored(parse_vector, options.position),
                "Default: in front of the model, so that all of it is seen");
    text_option("--camera-focal-point", "X,Y,Z", stored(parse_vector, options.focal_point),
                "Default: the model's centre");
    text_option("--camera-view-up", "X,Y,Z", stored(parse_vector, options.view_up), "Default: the model's up axis");
    app.add_option("--camera-view-angle", options.view_angle, "Vertical angle of view, degrees")
        ->check(CLI::Range(0.01, 170.0))
        ->capture_default_str();
    app.option_defaults()->group("Look");
    text_option("--background-color,--background-colour", "R,G,B", stored(parse_colour, options.render.background),
                "sRGB, each 0..1; default 0.2,0.2,0.2");
    app.add_flag_callback(
        "--ignore-point-colours,--ignore-point-colors", [&options] { options.render.point_colours = false; },
        "Draw points in the colour of their material");
    app.add_option_function<int>(
           "--level", [&options](int level) { options.render.level = options.load.max_level = level; },
           "Finest detail level to draw; default, and above the depth: the finest there is")
        ->check(CLI::Range(0, kMaxDepth));
    app.add_option("--max-error", options.max_error,
                   "Largest edge of the voxels drawn, pixels; finer detail is left out")
        ->check(CLI::Range(0.1, 64.0))
        ->capture_default_str();
    app.option_defaults()->group("Options");
    command_line::add_max_memory(app, options.load.max_memory);
    command_line::add_threads(app, options.load.threads);
    command_line::add_quiet(app, options.verbosity);
    command_line::add_verbose(app, options.verbosity, "Say where the camera stands");
}

void add_renderer_option(CLI::App &app, ViewOptions &options) {
    app.add_option_function<std::string>(
           "--renderer",
           [&options](const std::string &name) {
               options.renderer = name == "fast" ? Renderer::fast : Renderer::reference;
           },
           "fast (default); reference: slow and plain, draws every point of one level")
        ->type_name("fast|reference")
        ->check([](const std::string &name) {
            return name == "fast" || name == "reference" ? std::string()
                                                         : "'" + name + "' is no renderer; write fast or reference";
        })
        ->group("Look");
}

Result<Camera> choose_camera(const ViewOptions &options, const Sphere &bounds, UpAxis up, glm::ivec2 size) {
    Camera camera = default_camera(bounds, up, size.x, size.y, glm::radians(options.view_angle));
    camera.position = options.position.value_or(camera.position);
    camera.focal_point = options.focal_point.value_or(camera.focal_point);
    camera.up = options.view_up.value_or(camera.up);
    if (!is_usable(camera))
        return Error{ErrorCode::usage, 0,
                     "the camera sees nothing: it stands at its focal point or looks along its view-up, or a number is "
                     "missing"};
    return camera;
}

DetailView detail_view(const ViewOptions &options, const Camera &camera, glm::ivec2 size, double max_error) {
    return {.camera = camera,
            .width = size.x,
            .height = size.y,
            .max_error = max_error,
            .finest = std::max(1, options.render.level)};
}

std::string view_as_options(const Camera &camera, double view_angle, glm::ivec2 size) {
    return "--resolution=" + std::to_string(size.x) + "," + std::to_string(size.y) +
           " --camera-position=" + vector_text(camera.position) +
           " --camera-focal-point=" + vector_text(camera.focal_point) + " --camera-view-up=" + vector_text(camera.up) +
           " --camera-view-angle=" + number_text(view_angle);
}

Status check_picture_memory(glm::ivec2 size, const LoadOptions &load) {
    constexpr std::uint64_t kBytesPerPixel = 16; // colour, depth, and two copies to encode or to show
    const auto pixels = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
    if (pixels * kBytesPerPixel <= load.max_memory)
        return {};
    return Error{ErrorCode::memory, 0,
                 "a picture of " + std::to_string(size.x) + "x" + std::to_string(size.y) +
                     " needs more than --max-memory; choose a smaller --resolution"};
}

} // namespace pbm
