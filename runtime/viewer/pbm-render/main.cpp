// pbm-render: pictures of a binary voxel grid without a window.
#include "arguments.h"
#include "command_line/common_options.h"
#include "command_line/json_report.h"
#include "command_line/web_viewer.h"
#include "model_drawer.h"
#include "report.h"
#include "system/files/file_names.h"
#include "system/processes/this_process.h"
#include "system/threads/parallel.h"
#include "viewer/cameras/camera_file.h"
#include "viewer/cameras/model_views.h"
#include "viewer/navigation/camera_control.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/options/option_values.h"
#include "viewer/pictures/image_writer.h"
#include "viewer/scene/scene.h"

#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <system_error>

namespace {

using namespace pbm;

// Approximate bytes of heap that a picture takes beside its pixels.
constexpr std::size_t kPictureMemory = 12 << 20;

int fail(const std::string &file, const Error &error) {
    return command_line::fail(kProgram, file, with_advice(kProgram, error));
}

class Stopwatch {
  public:
    double milliseconds() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// The camera of the first frame round the model. The camera options must be usable.
Camera first_frame(const ViewOptions &view, const ModelDrawer &drawer) {
    return choose_turntable(view, drawer.extent(), drawer.grid(), view.resolution).value();
}

// Times frames from all around the model, without loading.
Result<BenchStatistics> bench(ModelDrawer &drawer, const Camera &first, int frames, Framebuffer &picture) {
    std::vector<double> times;
    BenchStatistics statistics;
    for (int i = 0; i < frames; ++i) {
        const Camera camera = orbit(first, first.up, glm::two_pi<double>() * i / frames, 0);
        if (Status loaded = drawer.load(camera, {picture.width, picture.height}, Motion::moving); !loaded)
            return std::move(loaded).error();
        const Stopwatch frame;
        statistics.drawn_points += drawer.draw(camera, picture, Motion::moving).drawn_points;
        times.push_back(frame.milliseconds());
    }
    std::sort(times.begin(), times.end());
    statistics.min_ms = times.front();
    statistics.median_ms = times[times.size() / 2];
    statistics.drawn_points /= times.size();
    return statistics;
}

Status write_picture(const std::string &name, const Result<Bytes> &file) {
    return file ? command_line::write_bytes(name, *file) : Status(file.error());
}

// Draws and writes a picture for programs that compose pictures. Returns the exit code on failure.
std::optional<int> make_layers(const RenderArguments &arguments, ModelDrawer &drawer, const Camera &camera,
                               RunStatistics &statistics) {
    const Stopwatch drawing;
    const PictureLayers layers =
        drawer.draw_layers(camera, arguments.view.resolution, arguments.motion(), statistics.drawn);
    statistics.frame_ms = drawing.milliseconds();
    statistics.cost = drawer.cost();
    if (const Status whole = drawer.damage(); !whole)
        return fail(arguments.input, whole.error());
    const Stopwatch encoding;
    if (const Status written = write_picture(arguments.output, encode_exr(layers)); !written)
        return fail(arguments.output, written.error());
    statistics.encode_ms = encoding.milliseconds();
    return std::nullopt;
}

// The picture for screens that are turned.
Result<Framebuffer> draw_turned(const RenderArguments &arguments, ModelDrawer &drawer, const Camera &camera) {
    const ViewOptions &view = arguments.view;
    const Screen &phone = kScreens[0];
    const glm::ivec2 from = view.resolution;
    const glm::ivec2 size(from.y, from.x > from.y ? from.y * phone.height / phone.width : from.x);
    Result<Camera> turned = choose_camera(view, drawer.extent(), drawer.grid(), size);
    if (!turned)
        return turned.error();
    if (view.position) // the element shows as much of the model as before
        turned->position = camera.focal_point + (camera.position - camera.focal_point) *
                                                    distance_factor(camera.view_angle, view.resolution, size);
    if (Status loaded = drawer.load(*turned, size, Motion::still); !loaded)
        return std::move(loaded).error();
    Framebuffer picture(size.x, size.y, drawer.needs_depths());
    drawer.draw(*turned, picture, Motion::still);
    return picture;
}

// Bytes of the model that a visitor with this screen loads.
Result<std::uint64_t> visit_cost(const RenderArguments &arguments, const std::string &model, const Screen &screen) {
    ViewOptions view = arguments.view;
    view.resolution = {screen.width, screen.height};
    const auto drawer = ModelDrawer::open(model, view);
    if (!drawer)
        return drawer.error();
    const auto camera = choose_camera(view, (*drawer)->extent(), (*drawer)->grid(), view.resolution);
    if (!camera)
        return camera.error();
    if (Status loaded = (*drawer)->load(*camera, view.resolution, Motion::still); !loaded)
        return std::move(loaded).error();
    return (*drawer)->cost().bytes_read;
}

// Writes the page whose poster is `picture`. Returns the exit code on failure.
std::optional<int> make_page(const RenderArguments &arguments, ModelDrawer &drawer, const Camera &camera,
                             const Framebuffer &picture, RunStatistics &statistics) {
    const auto turned = draw_turned(arguments, drawer, camera);
    if (!turned)
        return fail(arguments.input, turned.error());
    const std::filesystem::path name = std::filesystem::path(uncompressed_name(arguments.input)).filename();
    const auto page = write_web_page({.folder = arguments.page,
                                      .model = drawer.path(),
                                      .name = std::filesystem::path(name).replace_extension(".pbvg").string(),
                                      .metadata = drawer.metadata(),
                                      .view = arguments.view,
                                      .camera = camera,
                                      .extent = drawer.extent(),
                                      .up = up_of(arguments.view, drawer.grid()),
                                      .poster = picture,
                                      .turned = *turned,
                                      .language = arguments.page_language,
                                      .url = arguments.page_url});
    if (!page)
        return fail("--page", page.error());
    statistics.page = *page;
    for (std::size_t i = 0; i < kScreens.size(); ++i) {
        const auto cost = visit_cost(arguments, drawer.path(), kScreens[i]);
        if (!cost)
            return fail(arguments.input, cost.error());
        statistics.page->viewed[i] = *cost;
    }
    return std::nullopt;
}

// Draws the picture with `threads` threads and writes its outputs. Returns the exit code on failure.
std::optional<int> make_picture(const RenderArguments &arguments, ModelDrawer &drawer, const Camera &camera,
                                int threads, RunStatistics &statistics) {
    const ViewOptions &view = arguments.view;
    const bool with_depths = drawer.needs_depths() || !arguments.depth_output.empty();
    Framebuffer picture(view.resolution.x, view.resolution.y, with_depths);
    // On an opaque background every pixel is opaque: rows can be encoded before all of them are drawn.
    std::optional<PngBands> bands;
    RowTasks tasks;
    const bool is_picture = !arguments.output.empty() && *arguments.form() != PictureForm::exr;
    if (is_picture && *arguments.form() == PictureForm::png && view.look.render.background[3] == 255) {
        bands.emplace(picture, true, threads);
        statistics.is_encoded_while_drawn = true;
        tasks = {.count = bands->count(),
                 .end_row = [&](std::size_t band) { return bands->end_row(band); },
                 .run = [&](std::size_t band, std::size_t thread) { bands->encode(band, thread); }};
    }
    const Stopwatch drawing;
    statistics.drawn = drawer.draw(camera, picture, arguments.motion(), tasks);
    statistics.frame_ms = drawing.milliseconds();
    statistics.cost = drawer.cost();
    if (const Status whole = drawer.damage(); !whole)
        return fail(arguments.input, whole.error());

    if (is_picture) {
        const Stopwatch encoding;
        auto file = bands ? bands->finish() : encode_picture(picture, *arguments.form(), view.load.threads);
        if (!file)
            return fail(arguments.output, file.error());
        if (const int dpi = view.look.finish.dpi; dpi != 0)
            set_dpi(dpi, *arguments.form(), *file);
        statistics.encode_ms = encoding.milliseconds();
        if (const Status written = command_line::write_bytes(arguments.output, *file); !written)
            return fail(command_line::output_name(arguments.output), written.error());
    }
    if (!arguments.depth_output.empty()) {
        drawer.count_depths_from(camera, picture.depth);
        if (const Status written = command_line::write_bytes(arguments.depth_output, encode_depth_pfm(picture));
            !written)
            return fail(command_line::output_name(arguments.depth_output), written.error());
    }
    if (!arguments.page.empty())
        if (const auto failed = make_page(arguments, drawer, camera, picture, statistics))
            return *failed;
    if (arguments.bench > 0) {
        const auto timed = bench(drawer, first_frame(view, drawer), arguments.bench, picture);
        if (!timed)
            return fail(arguments.input, timed.error());
        statistics.bench = *timed;
    }
    return std::nullopt;
}

// Records the video. Returns the exit code on failure.
std::optional<int> make_video(const RenderArguments &arguments, ModelDrawer &drawer, VideoSink sink,
                              RunStatistics &statistics) {
    const VideoOptions &video = arguments.video();
    const ViewOptions &view = arguments.view;
    std::ostream *const stream = command_line::report_stream(arguments.outputs());
    command_line::ProgressDisplay progress(view.verbosity);
    VideoRecorder recorder(std::move(sink), view.resolution, drawer.needs_depths(), view.load.threads,
                           view.load.max_memory);
    const Stopwatch recording;
    const Camera first = first_frame(view, drawer);
    const glm::dvec3 axis = up_direction(up_of(view, drawer.grid()));
    Status written;
    for (int frame = 0; frame < video.frames && written; ++frame) {
        const Camera from = turntable(first, axis, glm::two_pi<double>() * frame / video.frames);
        progress.show("video", static_cast<double>(frame) / video.frames);
        if (view.verbosity == command_line::Verbosity::verbose && stream != nullptr)
            *stream << "frame " << frame + 1 << ": " << view_as_options(from, view, view.resolution)
                    << look_as_options(arguments.frame_look()) << '\n';
        Status drawn = drawer.load(from, view.resolution, Motion::moving);
        if (drawn) {
            drawer.draw(from, recorder.canvas(), Motion::moving);
            drawn = drawer.damage();
        }
        if (!drawn) {
            progress.clear();
            Error error = std::move(drawn).error();
            error.message.insert(0, "frame " + std::to_string(frame + 1) + ": ");
            return fail(arguments.input, error);
        }
        written = recorder.add();
    }
    if (written)
        written = recorder.finish();
    progress.clear();
    if (!written)
        return command_line::fail(kProgram, command_line::output_name(video.output), written.error());
    // ffmpeg's output is a file of another size than the frames.
    std::error_code no_single_file;
    const auto size = std::filesystem::file_size(video.output, no_single_file);
    statistics.video = {.bytes = no_single_file ? recorder.bytes() : size, .ms = recording.milliseconds()};
    statistics.cost = drawer.cost();
    return std::nullopt;
}

// Draws the frames of the camera file. Returns the exit code on failure.
std::optional<int> make_sequence(const RenderArguments &arguments, ModelDrawer &drawer, RunStatistics &statistics) {
    std::ostream *const stream = command_line::report_stream(arguments.outputs());
    const bool is_verbose = arguments.view.verbosity == command_line::Verbosity::verbose;
    command_line::ProgressDisplay progress(arguments.view.verbosity);
    const auto drawn =
        draw_sequence(*arguments.sequence, arguments.view, drawer, progress, is_verbose ? stream : nullptr);
    progress.clear();
    if (!drawn)
        return fail(arguments.input, drawn.error());
    statistics.sequence = *drawn;
    statistics.cost = drawer.cost();
    return std::nullopt;
}

// Builds the model of a scan, with progress on standard error.
Result<PreparedModel> prepare(const RenderArguments &arguments) {
    command_line::ProgressDisplay display(arguments.view.verbosity);
    ScanOptions scans = arguments.scans;
    scans.fields = fields_to_keep(arguments.view.look);
    return prepare_model(arguments.input,
                         {.scans = scans,
                          .threads = arguments.view.load.threads,
                          .progress = [&](std::string_view step, double done) { display.show(step, done); }});
}

int run(RenderArguments arguments, std::span<std::byte> heap) {
    if (const auto refused = command_line::refuse_outputs(kProgram, {{arguments.input}}, arguments.outputs()))
        return *refused;
    const ViewOptions &view = arguments.view;
    if (const Status affordable = check_picture_memory(view); !affordable)
        return command_line::fail(kProgram, arguments.output, affordable.error());

    if (!arguments.page.empty())
        if (const auto viewer = command_line::find_web_viewer(arguments.page); !viewer)
            return fail("--page", viewer.error());
    const auto prepared = prepare(arguments);
    if (!prepared)
        return command_line::fail(kProgram, arguments.input, prepared.error());
    if (!prepared->warning.empty() && view.verbosity != command_line::Verbosity::quiet)
        command_line::warn(kProgram, prepared->warning);
    RunStatistics statistics;
    const Stopwatch loading;
    const auto pool = std::make_shared<ThreadPool>(resolve_threads(view.load.threads));
    if (pool->threads() > 1) { // while this thread opens the file
        const auto pixels = static_cast<std::size_t>(view.resolution.x) * static_cast<std::size_t>(view.resolution.y);
        pool->post(
            [=] { populate(heap.first(std::min(heap.size(), kPictureMemory + sizeof(std::uint32_t) * pixels))); });
    }
    const auto opened = ModelDrawer::open(prepared->file, view, pool);
    if (!opened)
        return fail(arguments.input, opened.error());
    ModelDrawer &drawer = **opened;
    if (const auto &path = arguments.path; path && !arguments.sequence)
        arguments.view = view_at(*path, path->begin, drawer.extent(), up_of(view, drawer.grid()), view);
    if (!view.view.empty()) {
        const auto found = find_view(drawer.metadata(), view.view);
        if (!found)
            return fail_usage(found.error().message);
        arguments.view = with_camera(view, *found);
    }
    if (arguments.preset && arguments.preset->kind == PresetKind::hero && !drawer.has_surroundings() &&
        view.verbosity != command_line::Verbosity::quiet)
        command_line::warn(kProgram,
                           "--preset hero: the model has no panorama or no ground; build it with --lights studio "
                           "--shadows --ground --panorama default, or name the scan");
    const auto camera = choose_camera(view, drawer.extent(), drawer.grid(), view.resolution);
    if (!camera && arguments.path)
        return command_line::fail(kProgram, arguments.camera_file, flat_camera());
    if (!camera)
        return camera.error().code == ErrorCode::usage ? fail_usage(camera.error().message)
                                                       : command_line::fail(kProgram, arguments.input, camera.error());
    const Status loaded = arguments.sequence ? Status() : drawer.load(*camera, view.resolution, arguments.motion());
    const bool is_coarser = !loaded && arguments.thumbnail > 0 && loaded.error().code == ErrorCode::memory;
    if (!loaded && !is_coarser)
        return fail(arguments.input, loaded.error());
    statistics.load_ms = loading.milliseconds();
    statistics.file_bytes = drawer.file_size();
    statistics.look = drawer.look();

    std::optional<VideoSink> sink; // opened first: an unwritable file is refused before drawing
    if (const std::string &name = arguments.video().output; !name.empty()) {
        auto open = open_video(arguments.video(), view.resolution);
        if (!open)
            return command_line::fail(kProgram, command_line::output_name(name), open.error());
        sink = std::move(*open);
    }
    if (arguments.wants_layers())
        if (const auto failed = make_layers(arguments, drawer, *camera, statistics))
            return *failed;
    if (arguments.wants_flat_picture())
        if (const auto failed = make_picture(arguments, drawer, *camera, pool->threads(), statistics))
            return *failed;
    if (sink)
        if (const auto failed = make_video(arguments, drawer, std::move(*sink), statistics))
            return *failed;

    if (arguments.sequence)
        if (const auto failed = make_sequence(arguments, drawer, statistics))
            return *failed;

    std::ostream *const stream = command_line::report_stream(arguments.outputs());
    if (view.verbosity != command_line::Verbosity::quiet && stream != nullptr)
        *stream << report(arguments, *camera, statistics);
    if (arguments.json.empty())
        return 0;
    return command_line::write_json(kProgram, arguments.json, to_json(arguments, statistics));
}

} // namespace

int main(int argc, char **argv) {
    return command_line::run_program(kProgram, [&] {
        RenderArguments arguments;
        const std::optional<int> done = parse(argc, argv, arguments);
        if (done)
            return *done;
        return run(std::move(arguments), use_large_pages());
    });
}
