// pbm-render: pictures of a binary voxel grid without a window.
#include "command_line/parse.h"
#include "pbm_format/layout.h"
#include "pbm_format/platform.h"
#include "pbm_format/reader.h"
#include "pbm_render/reference_renderer.h"

#include "viewer/image_writer.h"
#include "viewer/option_values.h"

#include <glm/trigonometric.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>

namespace {

using namespace pbm;

enum class Verbosity { quiet, normal, verbose };

struct Arguments {
    std::string input, output, depth_output;
    std::string json; // file, "-" for stdout, empty for none
    glm::ivec2 resolution{1280, 720};
    std::optional<glm::dvec3> position, focal_point, view_up;
    double view_angle = 30; // degrees
    RenderOptions render;
    LoadOptions load;
    int bench = 0; // further frames
    Verbosity verbosity = Verbosity::normal;
};

// What a run cost and drew.
struct RunStatistics {
    RenderStatistics drawn;
    double load_ms = 0, frame_ms = 0, png_ms = 0;
    std::optional<double> bench_ms; // median
};

constexpr std::string_view kProgram = "pbm-render";

constexpr std::array<command_line::OldSwitch, 1> kOldSwitches{{{"-IGNORE_POINT_COLOURS", "--ignore-point-colours"}}};

int fail_usage(const std::string &message) { return command_line::fail_usage(kProgram, message); }

// What a user can do about an error, starting with "; ", or nothing.
std::string_view advice(ErrorCode code) {
    switch (code) {
    case ErrorCode::memory: return "; allow more with --max-memory or draw a coarser --level";
    case ErrorCode::unsupported_version:
    case ErrorCode::unsupported_feature: return "; a newer pbm-render is needed";
    case ErrorCode::usage:
    case ErrorCode::io:
    case ErrorCode::not_bvg: return ""; // the message says it
    default: return "; pbm-validate names all damage, build the file anew";
    }
}

int fail(const std::string &file, Error error) {
    error.message += advice(error.code);
    return command_line::fail(kProgram, file, error);
}

// Stores what `parse` makes of an option's text.
template <class Parse, class Target> auto stored(Parse parse, Target &target) {
    return [parse, &target](const std::string &text) {
        auto value = parse(text);
        if (!value)
            throw CLI::ValidationError(value.error().message);
        target = *value;
    };
}

// Fills `arguments`, or returns the exit code of a program that has said all it had to say.
std::optional<int> parse(int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Draws a binary voxel grid (.bvg) into a PNG file.", "pbm-render"};
    app.add_option("FILE", arguments.input, "Model to draw")->required();
    app.option_defaults()->group("Output");
    app.add_option("-o,--output", arguments.output, "PNG file to write, - for standard output")->type_name("FILE");
    app.add_option("--depth-output", arguments.depth_output,
                   "PFM file of depths: distance along the view direction in model units, +inf where empty")
        ->type_name("FILE");
    const auto text_option = [&](const std::string &names, const char *type, auto store, const std::string &help) {
        app.add_option_function<std::string>(names, store, help)->type_name(type);
    };
    text_option("--resolution", "W,H", stored(parse_resolution, arguments.resolution), "Size of the picture, 1280,720");
    app.option_defaults()->group("Camera");
    text_option("--camera-position", "X,Y,Z", stored(parse_vector, arguments.position),
                "Default: in front of the model, so that all of it is seen");
    text_option("--camera-focal-point", "X,Y,Z", stored(parse_vector, arguments.focal_point),
                "Default: the model's centre");
    text_option("--camera-view-up", "X,Y,Z", stored(parse_vector, arguments.view_up), "Default: the model's up axis");
    app.add_option("--camera-view-angle", arguments.view_angle, "Vertical angle of view, degrees")
        ->check(CLI::Range(0.01, 170.0))
        ->capture_default_str();
    app.option_defaults()->group("Look");
    text_option("--background-color,--background-colour", "R,G,B", stored(parse_colour, arguments.render.background),
                "sRGB, each 0..1; default 0.2,0.2,0.2");
    bool no_background = false;
    app.add_flag("--no-background", no_background, "Transparent where nothing is drawn");
    bool ignore_colours = false;
    app.add_flag("--ignore-point-colours,--ignore-point-colors", ignore_colours,
                 "Draw points in the colour of their material");
    app.add_option("--level", arguments.render.level, "Detail level to draw; default, and above the depth: the finest")
        ->check(CLI::Range(0, kMaxDepth));
    app.option_defaults()->group("Options");
    text_option("--max-memory", "BYTES", stored(command_line::parse_bytes, arguments.load.max_memory),
                "Refuse what needs more; k, M, G after the number; default 8G");
    app.add_option("-j,--threads", arguments.load.threads, "Threads, 0 for all processors")->check(CLI::Range(0, 1024));
    app.add_option("--bench", arguments.bench, "Draw N further frames and report their median time")
        ->check(CLI::Range(1, 100000));
    app.add_option("--json", arguments.json, "Statistics as JSON, to FILE or (--json alone) to stdout")
        ->type_name("[=FILE]");
    app.add_flag_callback(
        "-q,--quiet", [&] { arguments.verbosity = Verbosity::quiet; }, "Say nothing but errors");
    app.add_flag_callback(
        "-v,--verbose", [&] { arguments.verbosity = Verbosity::verbose; }, "Say where the camera stands");
    app.set_version_flag("-V,--version", "pbm-render " PBM_VERSION);
    if (const auto done = command_line::parse(
            app, kProgram, argc, argv, kOldSwitches,
            {.most_used = {"--output", "--resolution", "--camera-position", "--no-background", "--help"},
             .examples = {{"pbm-render scan.bvg -o scan.png --resolution 1920,1080", "The whole model from the front."},
                          {"pbm-render scan.bvg -o - --no-background | display",
                           "A transparent picture for the next program."}}}))
        return done;
    if (arguments.output.empty() && arguments.depth_output.empty() && arguments.bench == 0)
        return fail_usage("nothing to do: name a picture with -o");
    if (const std::string extension = std::filesystem::path(arguments.output).extension().string();
        !extension.empty() && extension != ".png" && extension != ".PNG")
        return fail_usage(arguments.output + ": pictures are PNG files; choose a name that ends with .png");
    if (no_background)
        arguments.render.background = {0, 0, 0, 0};
    arguments.render.point_colours = !ignore_colours;
    arguments.load.max_level = arguments.render.level;
    return std::nullopt;
}

class Stopwatch {
  public:
    double milliseconds() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Camera choose_camera(const Arguments &arguments, const Model &model) {
    Camera camera =
        default_camera(model, arguments.resolution.x, arguments.resolution.y, glm::radians(arguments.view_angle));
    camera.position = arguments.position.value_or(camera.position);
    camera.focal_point = arguments.focal_point.value_or(camera.focal_point);
    camera.up = arguments.view_up.value_or(camera.up);
    return camera;
}

std::string to_json(const Arguments &arguments, const RunStatistics &s) {
    nlohmann::ordered_json json{{"width", arguments.resolution.x},
                                {"height", arguments.resolution.y},
                                {"level", s.drawn.level},
                                {"points", s.drawn.points},
                                {"drawn_points", s.drawn.drawn_points},
                                {"load_ms", s.load_ms},
                                {"frame_ms", s.frame_ms},
                                {"png_ms", s.png_ms}};
    if (s.bench_ms) {
        json["bench_frames"] = arguments.bench;
        json["bench_median_ms"] = *s.bench_ms;
    }
    json["peak_memory"] = peak_memory();
    return json.dump(2) + "\n";
}

void report(const Arguments &arguments, const Camera &camera, const RunStatistics &s) {
    if (arguments.verbosity == Verbosity::verbose)
        std::printf("camera: position %.9g,%.9g,%.9g, focal point %.9g,%.9g,%.9g, up %.6g,%.6g,%.6g, angle %.6g\n",
                    camera.position.x, camera.position.y, camera.position.z, camera.focal_point.x, camera.focal_point.y,
                    camera.focal_point.z, camera.up.x, camera.up.y, camera.up.z, arguments.view_angle);
    std::printf("%s: %dx%d, level %d, %llu of %llu points drawn, load %.1f ms, frame %.1f ms, png %.1f ms\n",
                command_line::printable(arguments.output.empty() ? arguments.input : arguments.output).c_str(),
                arguments.resolution.x, arguments.resolution.y, s.drawn.level,
                static_cast<unsigned long long>(s.drawn.drawn_points), static_cast<unsigned long long>(s.drawn.points),
                s.load_ms, s.frame_ms, s.png_ms);
    if (s.bench_ms)
        std::printf("bench: %d frames, median %.2f ms\n", arguments.bench, *s.bench_ms);
    std::fflush(stdout);
}

int run(const Arguments &arguments) {
    if (const auto refused = command_line::refuse_outputs(kProgram, {{arguments.input}},
                                                          {{arguments.output, arguments.depth_output, arguments.json}}))
        return *refused;
    // Colour, depth and the encoder's two copies.
    const auto pixels =
        static_cast<std::uint64_t>(arguments.resolution.x) * static_cast<std::uint64_t>(arguments.resolution.y);
    if (pixels * 16 > arguments.load.max_memory)
        return command_line::fail(kProgram, arguments.output,
                                  {ErrorCode::memory, 0,
                                   "a picture of " + std::to_string(arguments.resolution.x) + "x" +
                                       std::to_string(arguments.resolution.y) +
                                       " needs more than --max-memory; choose a smaller --resolution"});

    RunStatistics statistics;
    const Stopwatch loading;
    const auto file = MappedFile::open(arguments.input);
    if (!file)
        return fail(arguments.input, file.error());
    auto reader = Reader::open(file->bytes());
    if (!reader)
        return fail(arguments.input, reader.error());
    const auto model = load_model(*reader, arguments.load);
    if (!model)
        return fail(arguments.input, model.error());
    const ReferenceRenderer renderer(*model);
    statistics.load_ms = loading.milliseconds();

    const Camera camera = choose_camera(arguments, *model);
    if (!is_usable(camera))
        return fail_usage(
            "the camera sees nothing: it stands at its focal point or looks along its view-up, or a number is missing");
    Framebuffer picture(arguments.resolution.x, arguments.resolution.y);
    const Stopwatch drawing;
    statistics.drawn = renderer.render(camera, arguments.render, picture);
    statistics.frame_ms = drawing.milliseconds();
    if (arguments.bench > 0) {
        std::vector<double> times(static_cast<std::size_t>(arguments.bench));
        for (double &time : times) {
            const Stopwatch frame;
            renderer.render(camera, arguments.render, picture);
            time = frame.milliseconds();
        }
        std::nth_element(times.begin(), times.begin() + arguments.bench / 2, times.end());
        statistics.bench_ms = times[times.size() / 2];
    }

    if (!arguments.output.empty()) {
        const Stopwatch encoding;
        const auto png = encode_png(picture);
        if (!png)
            return fail(arguments.output, png.error());
        statistics.png_ms = encoding.milliseconds();
        if (const Status written = command_line::write_bytes(arguments.output, *png); !written)
            return fail(arguments.output, written.error());
    }
    if (!arguments.depth_output.empty())
        if (const Status written = command_line::write_bytes(arguments.depth_output, encode_depth_pfm(picture));
            !written)
            return fail(arguments.depth_output, written.error());

    const auto takes_stdout = [](const std::string &name) { return name == "-" || name == "/dev/stdout"; };
    const bool stdout_taken =
        takes_stdout(arguments.json) || takes_stdout(arguments.output) || takes_stdout(arguments.depth_output);
    if (arguments.verbosity != Verbosity::quiet && !stdout_taken)
        report(arguments, camera, statistics);
    if (arguments.json.empty())
        return 0;
    if (const Status told = command_line::write_text(arguments.json, to_json(arguments, statistics)); !told)
        return fail(arguments.json, told.error());
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    return command_line::run_program(kProgram, [&] {
        Arguments arguments;
        const std::optional<int> done = parse(argc, argv, arguments);
        return done ? *done : run(arguments);
    });
}
