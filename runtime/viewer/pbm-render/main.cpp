// pbm-render: pictures of a binary voxel grid without a window.
#include "command_line/common_options.h"
#include "pbm_format/platform.h"

#include "model_drawer.h"
#include "viewer/camera_control.h"
#include "viewer/image_writer.h"
#include "viewer/scene.h"
#include "viewer/view_options.h"

#include <glm/gtc/constants.hpp>
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
    int bench = 0; // frames
};

// Of the frames of --bench.
struct BenchStatistics {
    double least_ms = 0, median_ms = 0;
    std::uint64_t drawn_points = 0; // mean
};

// What a run cost and drew.
struct RunStatistics {
    RenderStatistics drawn;
    double load_ms = 0, frame_ms = 0, png_ms = 0;
    StreamingStatistics cost; // until the picture was drawn
    std::uint64_t file_bytes = 0;
    std::optional<BenchStatistics> bench;
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
    add_renderer_option(app, arguments.view);
    bool no_background = false;
    app.add_flag("--no-background", no_background, "Transparent where nothing is drawn")->group("Look");
    app.add_option("--bench", arguments.bench, "Draw N more frames once round the focal point; tell their times")
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
                                {"renderer", arguments.view.renderer == Renderer::fast ? "fast" : "reference"},
                                {"level", s.drawn.level},
                                {"points", s.drawn.points},
                                {"drawn_points", s.drawn.drawn_points},
                                {"file_bytes", s.file_bytes},
                                {"bytes_read", s.cost.bytes_read},
                                {"points_decoded", s.cost.points_decoded},
                                {"load_ms", s.load_ms},
                                {"frame_ms", s.frame_ms},
                                {"png_ms", s.png_ms}};
    if (s.bench) {
        json["bench_frames"] = arguments.bench;
        json["bench_min_ms"] = s.bench->least_ms;
        json["bench_median_ms"] = s.bench->median_ms;
        json["bench_drawn_points"] = s.bench->drawn_points;
    }
    json["peak_memory"] = peak_memory();
    return json.dump(2) + "\n";
}

std::string report(const Arguments &arguments, const Camera &camera, const RunStatistics &s) {
    const glm::ivec2 size = arguments.view.resolution;
    const std::string name = arguments.output.empty() ? arguments.input : arguments.output;
    std::ostringstream text;
    if (arguments.view.verbosity == command_line::Verbosity::verbose)
        text << "view: " << view_as_options(camera, arguments.view.view_angle, size) << '\n'
             << "read: " << s.cost.bytes_read << " of " << s.file_bytes << " bytes, " << s.cost.points_decoded
             << " points decoded\n";
    text << std::fixed << std::setprecision(1) << command_line::printable(name == "-" ? "standard output" : name)
         << ": " << size.x << 'x' << size.y << ", level " << s.drawn.level << ", " << s.drawn.drawn_points << " of "
         << s.drawn.points << " points drawn, load " << s.load_ms << " ms, frame " << s.frame_ms << " ms, png "
         << s.png_ms << " ms\n";
    if (s.bench)
        text << "bench: " << arguments.bench << " frames, minimum " << std::setprecision(2) << s.bench->least_ms
             << " ms, median " << s.bench->median_ms << " ms, " << s.bench->drawn_points << " points drawn, memory "
             << std::setprecision(1) << static_cast<double>(peak_memory()) / (1 << 20) << " MiB\n";
    return text.str();
}

// Frames from all around the model; what each needs is loaded before its time begins.
Result<BenchStatistics> bench(ModelDrawer &drawer, const Camera &first, int frames, Framebuffer &picture) {
    std::vector<double> times;
    BenchStatistics statistics;
    for (int i = 0; i < frames; ++i) {
        const Camera camera = orbit(first, glm::two_pi<double>() * i / frames, 0);
        if (Status loaded = drawer.load(camera, {picture.width, picture.height}); !loaded)
            return std::move(loaded).error();
        const Stopwatch frame;
        statistics.drawn_points += drawer.draw(camera, picture).drawn_points;
        times.push_back(frame.milliseconds());
    }
    std::sort(times.begin(), times.end());
    statistics.least_ms = times.front();
    statistics.median_ms = times[times.size() / 2];
    statistics.drawn_points /= times.size();
    return statistics;
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
    const auto opened = ModelDrawer::open(arguments.input, view);
    if (!opened)
        return fail(arguments.input, opened.error());
    ModelDrawer &drawer = **opened;
    const auto camera = choose_camera(view, drawer.bounds(), drawer.grid().up, view.resolution);
    if (!camera)
        return fail_usage(camera.error().message);
    if (const Status loaded = drawer.load(*camera, view.resolution); !loaded)
        return fail(arguments.input, loaded.error());
    statistics.load_ms = loading.milliseconds();

    const bool with_depths = drawer.needs_depths() || !arguments.depth_output.empty();
    Framebuffer picture(view.resolution.x, view.resolution.y, with_depths);
    const Stopwatch drawing;
    statistics.drawn = drawer.draw(*camera, picture);
    statistics.frame_ms = drawing.milliseconds();
    statistics.cost = drawer.cost();
    statistics.file_bytes = drawer.file_size();

    if (!arguments.output.empty()) {
        const Stopwatch encoding;
        const auto png = encode_png(picture, view.load.threads);
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
    if (arguments.bench > 0) {
        const auto timed = bench(drawer, *camera, arguments.bench, picture);
        if (!timed)
            return fail(arguments.input, timed.error());
        statistics.bench = *timed;
    }

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
    use_large_pages();
    return command_line::run_program(kProgram, [&] {
        Arguments arguments;
        const std::optional<int> done = parse(argc, argv, arguments);
        return done ? *done : run(arguments);
    });
}
