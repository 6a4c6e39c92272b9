// pbm-render: pictures of a binary voxel grid without a window.
#include "command_line/common_options.h"
#include "pbm_format/platform.h"

#include "viewer/image_writer.h"
#include "viewer/scene.h"
#include "viewer/view_options.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <optional>
#include <ostream>
#include <sstream>

namespace {

using namespace pbm;

struct Arguments {
    std::string input, output, depth_output;
    std::string json; // file, "-" for stdout, empty for none
    ViewOptions view;
    int bench = 0; // further frames
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

int fail(const std::string &file, const Error &error) {
    return command_line::fail(kProgram, file, with_advice(kProgram, error));
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
    add_view_options(app, arguments.view);
    bool no_background = false;
    app.add_flag("--no-background", no_background, "Transparent where nothing is drawn")->group("Look");
    app.add_option("--bench", arguments.bench, "Draw N further frames and report their median time")
        ->check(CLI::Range(1, 100000))
        ->group("Output");
    command_line::add_json(app, arguments.json, "Statistics");
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
        arguments.view.render.background = {0, 0, 0, 0};
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

std::string to_json(const Arguments &arguments, const RunStatistics &s) {
    nlohmann::ordered_json json{{"width", arguments.view.resolution.x},
                                {"height", arguments.view.resolution.y},
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

std::string report(const Arguments &arguments, const Camera &camera, const RunStatistics &s) {
    const glm::ivec2 size = arguments.view.resolution;
    const std::string name = arguments.output.empty() ? arguments.input : arguments.output;
    std::ostringstream text;
    if (arguments.view.verbosity == command_line::Verbosity::verbose)
        text << "view: " << view_as_options(camera, arguments.view.view_angle, size) << '\n';
    text << std::fixed << std::setprecision(1) << command_line::printable(name == "-" ? "standard output" : name)
         << ": " << size.x << 'x' << size.y << ", level " << s.drawn.level << ", " << s.drawn.drawn_points << " of "
         << s.drawn.points << " points drawn, load " << s.load_ms << " ms, frame " << s.frame_ms << " ms, png "
         << s.png_ms << " ms\n";
    if (s.bench_ms)
        text << "bench: " << arguments.bench << " frames, median " << std::setprecision(2) << *s.bench_ms << " ms\n";
    return text.str();
}

int run(const Arguments &arguments) {
    if (const auto refused = command_line::refuse_outputs(kProgram, {{arguments.input}},
                                                          {{arguments.output, arguments.depth_output, arguments.json}}))
        return *refused;
    const ViewOptions &view = arguments.view;
    if (const Status affordable = check_picture_memory(view.resolution, view.load); !affordable)
        return command_line::fail(kProgram, arguments.output, affordable.error());

    RunStatistics statistics;
    const Stopwatch loading;
    const auto loaded = load_scene(arguments.input, view.load);
    if (!loaded)
        return fail(arguments.input, loaded.error());
    const Scene &scene = **loaded;
    statistics.load_ms = loading.milliseconds();

    const auto camera =
        choose_camera(view, bounding_sphere(scene.model), scene.model.parameters.grid.up, view.resolution);
    if (!camera)
        return fail_usage(camera.error().message);
    Framebuffer picture(view.resolution.x, view.resolution.y);
    const Stopwatch drawing;
    statistics.drawn = scene.renderer.render(*camera, view.render, picture);
    statistics.frame_ms = drawing.milliseconds();
    if (arguments.bench > 0) {
        std::vector<double> times(static_cast<std::size_t>(arguments.bench));
        for (double &time : times) {
            const Stopwatch frame;
            scene.renderer.render(*camera, view.render, picture);
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

    std::ostream *const stream =
        command_line::report_stream({{arguments.output, arguments.depth_output}}, arguments.json);
    if (view.verbosity != command_line::Verbosity::quiet && stream != nullptr)
        *stream << report(arguments, *camera, statistics);
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
