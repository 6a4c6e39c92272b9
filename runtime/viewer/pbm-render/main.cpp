// pbm-render: pictures of a binary voxel grid without a window.
#include "command_line/common_options.h"
#include "command_line/json_report.h"
#include "command_line/web_viewer.h"
#include "system/files/file_names.h"
#include "system/processes/this_process.h"
#include "system/threads/parallel.h"

#include "model_drawer.h"
#include "pbm_format/model/las_classes.h"
#include "sequence.h"
#include "viewer/cameras/camera_file.h"
#include "viewer/navigation/camera_control.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/options/option_values.h"
#include "viewer/options/preset.h"
#include "viewer/options/video_options.h"
#include "viewer/options/view_options.h"
#include "viewer/pictures/image_writer.h"
#include "viewer/pictures/picture_file.h"
#include "viewer/scene/scene.h"
#include "web_page.h"

#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <optional>
#include <ostream>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <system_error>

namespace {

using namespace pbm;

struct Arguments {
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

struct BenchStatistics {
    double min_ms = 0, median_ms = 0;
    std::uint64_t drawn_points = 0; // mean
};

struct VideoStatistics {
    std::uint64_t bytes = 0; // of the file, or of all frames
    double ms = 0;
};

// What a run drew and cost.
struct RunStatistics {
    LookOptions look; // as drawn
    RenderStatistics drawn;
    double load_ms = 0, frame_ms = 0;
    double encode_ms = 0;                // after the picture was drawn
    bool is_encoded_while_drawn = false; // most of it
    StreamingStatistics cost;            // until the picture was drawn
    std::uint64_t file_bytes = 0;
    std::optional<BenchStatistics> bench;
    std::optional<VideoStatistics> video;
    std::optional<SequenceStatistics> sequence;
    std::optional<WebPageSizes> page;
};

constexpr std::string_view kProgram = "pbm-render";

// Approximate bytes of heap that a picture takes beside its pixels.
constexpr std::size_t kPictureMemory = 8 << 20;

int fail_usage(const std::string &message) { return command_line::fail_usage(kProgram, message); }

int fail(const std::string &file, const Error &error) {
    return command_line::fail(kProgram, file, with_advice(kProgram, error));
}

// A thumbnail holds at most this many bytes of decoded chunks: with the program, the pixels and what was read of a file
// it takes less than 64 MB. A model that needs more is drawn coarser.
constexpr std::uint64_t kThumbnailMemory = 20 << 20;
constexpr int kMaxThumbnail = 1024, kMaxFineThumbnail = 512; // pixels; a larger fine one takes too much time and memory
constexpr double kFastThumbnailError = 2.84;                 // pixels: largest edge of a voxel of a fast one
constexpr int kMaxThumbnailThreads = 4;                      // each takes memory of its own

// The options that --thumbnail stands for. `edge`: pixels.
void preset_thumbnail(int edge, ViewOptions &view) {
    view.resolution = {edge, edge};
    view.look.quality = edge <= kMaxFineThumbnail ? Quality::fine : Quality::fast;
    view.look.samples = std::clamp(2 * kMaxFineThumbnail / edge, 1, kDefaultSamples);
    if (edge > kMaxFineThumbnail)
        view.max_error = kFastThumbnailError;
    view.look.render.background = {0, 0, 0, 0};
    view.look.render.panorama = view.look.render.ground = view.look.legend = false;
    view.load.max_memory = kThumbnailMemory;
    view.load.threads = std::min(resolve_threads(0), kMaxThumbnailThreads);
}

// The size with the same aspect, up to rounding, whose edges are at most `edge` pixels.
glm::ivec2 fitted(glm::ivec2 size, int edge) {
    const int longest = std::max({size.x, size.y, edge});
    const auto scaled = [&](int pixels) {
        return std::max(1, static_cast<int>(std::lround(static_cast<double>(pixels) * edge / longest)));
    };
    return {scaled(size.x), scaled(size.y)};
}

// What is wrong with a code of a language; empty: nothing.
std::string check_language(const std::string &code) {
    const bool is_code = !code.empty() && code.size() <= 35 && std::all_of(code.begin(), code.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    });
    return is_code ? "" : "'" + code + "' is no code of a language; write en, de or de-CH";
}

void add_camera_file(command_line::CommandLine &line, Arguments &arguments) {
    line.add("--camera-file",
             "Camera of a glTF file, and its animation: -o name_%04d.exr draws every frame (.png, .jpg)",
             &arguments.camera_file,
             {.type = "FILE.gltf|glb[,NAME]",
              .check = command_line::readable(parse_camera_file),
              .excludes = {"--camera-position", "--camera-focal-point", "--camera-view-up", "--camera-view-angle",
                           "--projection", "--turntable", "--avi"},
              .topic = "Camera"});
    line.add("--resume", "Keep frames of a sequence that are there", &arguments.resume,
             {.needs = "--camera-file", .topic = "Video"});
}

// The frames that are asked for; `path` and `given` are known.
Result<Sequence> sequence_of(const Arguments &arguments) {
    const auto names = parse_frame_names(arguments.output);
    if (!names)
        return names.error();
    if (arguments.thumbnail > 0 || !arguments.depth_output.empty() || !arguments.page.empty() || arguments.bench > 0)
        return Error{ErrorCode::usage, 0, "a sequence has no thumbnail, depth file, page or bench"};
    if (arguments.given.contains("--frames") && !arguments.choice.part)
        return Error{ErrorCode::usage, 0, "--frames of a sequence is a part of it, like 1-40"};
    const double fps = arguments.given.contains("--fps") ? arguments.video().fps
                                                         : arguments.path->rate.value_or(arguments.video().fps);
    const int all = frame_count(*arguments.path, fps);
    const std::string length = std::to_string(all) + " frames at " + to_string(Value(fps)) + " a second";
    if (all > kMaxFrames)
        return Error{ErrorCode::usage, 0, "the animation has " + length + ", more than " + std::to_string(kMaxFrames)};
    FrameRange frames = arguments.choice.part.value_or(FrameRange{1, all});
    if (frames.first > all)
        return Error{ErrorCode::usage, 0,
                     "--frames begins at " + std::to_string(frames.first) + ", and the animation has " + length};
    frames.last = std::min(frames.last, all);
    return Sequence{*arguments.path, fps, frames, *names, *arguments.form(), arguments.resume};
}

// Reads the camera file. Returns the exit code on failure.
std::optional<int> take_camera_file(Arguments &arguments) {
    const bool is_sequence = !arguments.camera_file.empty() && names_frames(arguments.output);
    if (!is_sequence && (arguments.resume || arguments.choice.part))
        return fail_usage("--resume and parts of --frames are of a sequence: --camera-file, and a name like "
                          "-o name_%04d.png");
    if (arguments.camera_file.empty())
        return std::nullopt;
    const CameraChoice choice = *parse_camera_file(arguments.camera_file);
    auto path = read_camera(choice);
    if (!path)
        return command_line::fail(kProgram, choice.file, path.error());
    arguments.path = std::move(*path);
    ViewOptions &view = arguments.view;
    if (const double aspect = arguments.path->lens.aspect;
        aspect > 0 && !arguments.given.contains("--resolution") && arguments.thumbnail == 0)
        view.resolution.x =
            static_cast<int>(std::clamp(std::round(view.resolution.y * aspect), 1.0, 1.0 * kMaxPictureEdge));
    if (!is_sequence)
        return std::nullopt;
    auto sequence = sequence_of(arguments);
    if (!sequence)
        return fail_usage(sequence.error().message);
    arguments.sequence = std::move(*sequence);
    return std::nullopt;
}

// Fills `arguments`, or returns the exit code if the program is done.
std::optional<int> parse(int argc, char **argv, Arguments &arguments) {
    command_line::CommandLine line{std::string(kProgram),
                                   "Draws a binary voxel grid (.pbvg) into a picture or a video.\n"
                                   "A scan is drawn as the model that pbm-build makes of it."};
    line.add("FILE", "Model to draw, or a scan", &arguments.input, {.required = true});
    line.topic = "Output";
    line.add("-o,--output", "Picture: .png .jpg .bmp .exr; - for standard output", &arguments.output, {.type = "FILE"});
    line.add("--depth-output", "PFM file of depths: distance along the view direction in model units, +inf where empty",
             &arguments.depth_output, {.type = "FILE"});
    line.add("--page",
             "A folder for a web server: index.html, which shows the model in this view, and all that it needs",
             &arguments.page, {.type = "DIR"});
    line.add("--page-lang", "Language of the page: en, de or another code of HTML; texts are German or English",
             &arguments.page_language, {.type = "CODE", .check = check_language, .needs = "--page"});
    line.add("--page-url", "Where the page will be, so that previews of it find its picture", &arguments.page_url,
             {.type = "URL", .needs = "--page"});
    // Before the options of the view: those that are given too are stored later and win.
    line.add("--thumbnail",
             "A picture for a file manager, PNG whatever its name: at most N x N pixels, the model alone on a "
             "transparent background, drawn in 64 MB of memory; options of size, quality and look change it",
             [&arguments](int edge) {
                 arguments.thumbnail = edge;
                 preset_thumbnail(edge, arguments.view);
             },
             {.type = "N", .check = command_line::Integers{1, kMaxThumbnail}});
    line.add("--preset", "A look in a word, for a catalogue or a title; options that are given too win",
             [&arguments](const std::string &text) -> Status {
                 arguments.preset = *parse_preset(text);
                 set_preset(*arguments.preset, arguments.view);
                 arguments.scans.options = build_options(*arguments.preset);
                 return {};
             },
             {.type = "plate|hero|clay|raking[,ANGLE]", .check = command_line::readable(parse_preset)});
    add_view_options(line, arguments.view);
    add_finish_options(line, arguments.view.look.finish);
    add_renderer_option(line, arguments.view);
    add_scan_options(line, arguments.scans);
    bool no_background = false;
    line.add("--no-background", "Transparent where nothing is, without panorama", &no_background, {.topic = "Look"});
    line.add("--bench", "Draw N more frames once round the focal point; print their times", &arguments.bench,
             {.check = command_line::Integers{1, 100000}, .topic = "Output"});
    add_video_options(line, arguments.choice);
    add_camera_file(line, arguments);
    command_line::add_json(line, arguments.json, "Statistics");
    line.add_version(PBM_VERSION);
    if (const auto done = command_line::parse(
            line, argc, argv, old_switches({kOldVideoSwitch}),
            {.most_used = {"--output", "--resolution", "--preset", "--turntable", "--no-background", "--help"},
             .examples = {
                 {"pbm-render scan.pbvg -o scan.png --resolution 1920,1080", "The whole model from the front."},
                 {"pbm-render scan.pbvg -o - --no-background | display", "A transparent picture for the next program."},
                 {"pbm-render scan.ply --preset plate -o plate.png",
                  "A plate for a catalogue, with a scale bar, 152 x 203 mm."},
                 {"pbm-render scan.pbvg -q --thumbnail 256 -o scan.png", "A thumbnail."},
                 {"pbm-render scan.pbvg --page site",
                  "A page that shows the model; try it with python3 -m http.server -d site."},
                 {"pbm-render scan.pbvg --turntable scan.avi --quality fine",
                  "A video once round the model; fine frames take 10 to 20 times as long."},
                 {"pbm-render scan.pbvg --turntable - | ffmpeg -f rawvideo -pix_fmt rgb24 -s 1280x720 -r 30 "
                  "-i - -vf scale=out_color_matrix=bt709,format=yuv420p -colorspace bt709 -color_primaries bt709 "
                  "-color_trc bt709 scan.webm",
                  "The same in any other form, with the colours of the pictures."}}}))
        return done;
    for (const command_line::GivenValue &value : line.given)
        arguments.given.insert(value.name);
    if (no_background) {
        arguments.view.look.render.background = {0, 0, 0, 0};
        arguments.view.look.render.panorama = false;
    }
    if (arguments.thumbnail > 0) {
        if (arguments.view.renderer == Renderer::reference)
            return fail_usage("--renderer reference loads whole levels; leave out --thumbnail");
        arguments.view.resolution = fitted(arguments.view.resolution, arguments.thumbnail);
    }
    if (arguments.view.renderer == Renderer::reference && arguments.view.look.quality == Quality::fine)
        return fail_usage("--renderer reference draws no fine pictures; leave out --quality fine");
    if (arguments.view.renderer == Renderer::reference)
        arguments.view.look.quality = Quality::fast;
    if (const Status known = complete_video(arguments.choice, arguments.input, arguments.view.look.render); !known)
        return fail_usage(known.error().message);
    if (arguments.output.empty() && !arguments.wants_picture() && arguments.video().output.empty())
        return fail_usage("nothing to do: name a picture with -o, a video with --turntable or a page with --page");
    if (const auto form = arguments.form(); !form)
        return fail_usage(form.error().message);
    RenderOptions &render = arguments.view.look.render;
    if (arguments.wants_layers() && arguments.view.renderer == Renderer::reference)
        return fail_usage("--renderer reference draws no .exr; leave it out");
    if (*arguments.form() == PictureForm::jpeg && render.background[3] == 0)
        return fail_usage(arguments.output + ": JPEG has no transparency; choose .png or leave out --no-background");
    if (arguments.wants_layers() && render.background == RenderOptions{}.background && !render.background_below)
        render.background = {0, 0, 0, 0}; // alpha is coverage
    return take_camera_file(arguments);
}

class Stopwatch {
  public:
    double milliseconds() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

nlohmann::ordered_json look_json(const LookOptions &look) {
    const RenderOptions &render = look.render;
    nlohmann::ordered_json json{
        {"quality", word_of(look.quality)},   {"samples", look.quality == Quality::fine ? look.samples : 1},
        {"texture", render.texture},          {"point_colours", render.point_colours},
        {"shading", word_of(render.shading)}, {"shadows", render.shadows},
        {"panorama", render.panorama},        {"ground", render.ground},
        {"reflections", render.reflections},  {"depth_cue", word_of(look.depth_cue.value_or(DepthCue::none))},
        {"exposure", look.finish.exposure},   {"tone", word_of(look.finish.tone)}};
    if (look.colour_by)
        json["colour_by"] = look.colour_by->field;
    if (look.classes.dropped.any())
        json["drop_class"] = list_of(look.classes.dropped);
    if (look.classes.shown)
        json["show_class"] = list_of(*look.classes.shown);
    return json;
}

std::string to_json(const Arguments &arguments, const RunStatistics &s) {
    nlohmann::ordered_json json{{"width", arguments.view.resolution.x},
                                {"height", arguments.view.resolution.y},
                                {"renderer", arguments.view.renderer == Renderer::fast ? "fast" : "reference"},
                                {"look", look_json(look_of(arguments.motion(), s.look))},
                                {"level", s.drawn.level},
                                {"points", s.drawn.points},
                                {"drawn_points", s.drawn.drawn_points},
                                {"file_bytes", s.file_bytes},
                                {"bytes_read", s.cost.bytes_read},
                                {"points_decoded", s.cost.points_decoded},
                                {"load_ms", s.load_ms},
                                {"frame_ms", s.frame_ms},
                                {"encode_ms", s.encode_ms}};
    if (s.bench) {
        json["bench_frames"] = arguments.bench;
        json["bench_min_ms"] = s.bench->min_ms;
        json["bench_median_ms"] = s.bench->median_ms;
        json["bench_drawn_points"] = s.bench->drawn_points;
    }
    if (s.video) {
        json["video_frames"] = arguments.video().frames;
        json["video_fps"] = arguments.video().fps;
        json["video_bytes"] = s.video->bytes;
        json["video_ms"] = s.video->ms;
    }
    if (s.sequence)
        json["sequence"] = {{"camera", arguments.sequence->path.name},
                            {"fps", arguments.sequence->fps},
                            {"first_frame", arguments.sequence->frames.first},
                            {"last_frame", arguments.sequence->frames.last},
                            {"drawn", s.sequence->drawn},
                            {"kept", s.sequence->kept},
                            {"bytes", s.sequence->bytes},
                            {"ms", s.sequence->ms}};
    if (s.page)
        json["page"] = {{"page_bytes", s.page->page},
                        {"poster_bytes", s.page->poster},
                        {"viewer_gzip_bytes", s.page->viewer},
                        {"threaded_viewer_gzip_bytes", s.page->threaded_viewer},
                        {"model_bytes", s.page->model},
                        {"phone_model_bytes", s.page->viewed[0]},
                        {"laptop_model_bytes", s.page->viewed[1]},
                        {"4k_model_bytes", s.page->viewed[2]},
                        {"page_kept", s.page->is_kept}};
    json["peak_memory"] = peak_memory();
    return json.dump(2) + "\n";
}

// Empty for fast pictures.
std::string quality_text(const LookOptions &look) {
    return look.quality == Quality::fine ? "fine, " + std::to_string(look.samples) + " samples, " : "";
}

std::string video_text(const Arguments &arguments, const VideoStatistics &cost) {
    const VideoOptions &video = arguments.video();
    const glm::ivec2 size = arguments.view.resolution, stored = stored_size(video.output, size);
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << command_line::printable(command_line::output_name(video.output))
         << ": " << video.frames << " frames of " << size.x << 'x' << size.y;
    if (stored != size)
        text << " (the edge repeated to " << stored.x << 'x' << stored.y << ", since H.264 has even sizes)";
    text << ", " << quality_text(arguments.frame_look()) << cost.bytes << " bytes, " << cost.ms / 1000 << " s\n";
    return text.str();
}

std::string sequence_text(const Arguments &arguments, const SequenceStatistics &cost) {
    const Sequence &sequence = *arguments.sequence;
    const glm::ivec2 size = arguments.view.resolution;
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << command_line::printable(arguments.output) << ": frames "
         << sequence.frames.first << " to " << sequence.frames.last << " of "
         << frame_count(sequence.path, sequence.fps) << ", " << to_string(Value(sequence.fps)) << " a second, camera "
         << command_line::printable(sequence.path.name) << ", " << size.x << 'x' << size.y << ", "
         << quality_text(look_of(Motion::still, arguments.view.look)) << cost.drawn << " drawn, " << cost.kept
         << " kept, " << cost.bytes << " bytes, " << cost.ms / 1000 << " s\n";
    return text.str();
}

// What visitors of a page load.
std::string page_text(const std::string &folder, const WebPageSizes &sizes) {
    const auto kilobytes = [](std::uint64_t bytes) { return std::to_string((bytes + 500) / 1000) + " KB"; };
    const std::string name = command_line::printable(folder);
    std::string text = name + ": a page that loads " + kilobytes(sizes.page + sizes.poster) + " with its poster, " +
                       kilobytes(sizes.viewer) + " of the viewer (gzip), and of the " + kilobytes(sizes.model) +
                       " of the model for the whole view";
    for (std::size_t i = 0; i < kScreens.size(); ++i) {
        const Screen &screen = kScreens[i];
        text += (i == 0 ? " " : ", ") + kilobytes(sizes.viewed[i]) + " on " + screen.name + " (" +
                std::to_string(screen.width) + 'x' + std::to_string(screen.height) + ')';
    }
    text += '\n';
    if (sizes.is_kept)
        text += name + "/index.html: somebody edited it, so it stays as it is; remove it to have it written anew\n";
    return text;
}

// The report of a run; `camera` is that of the first picture.
std::string report(const Arguments &arguments, const Camera &camera, const RunStatistics &s) {
    const glm::ivec2 size = arguments.view.resolution;
    const auto shown_name = [](const std::string &name) {
        return command_line::printable(command_line::output_name(name));
    };
    std::ostringstream text;
    const bool is_verbose = arguments.view.verbosity == command_line::Verbosity::verbose;
    if (is_verbose && !arguments.sequence) // whose frames had a line each
        text << "view: " << view_as_options(camera, arguments.view, size) << look_as_options(s.look) << '\n'
             << "read: " << s.cost.bytes_read << " of " << s.file_bytes << " bytes, " << s.cost.points_decoded
             << " points decoded\n";
    text << std::fixed << std::setprecision(1);
    if (arguments.wants_picture())
        text << shown_name(arguments.output.empty() ? arguments.input : arguments.output) << ": " << size.x << 'x'
             << size.y << ", " << quality_text(arguments.picture_look()) << "level " << s.drawn.level << ", "
             << s.drawn.drawn_points << " of " << s.drawn.points << " points drawn, load " << s.load_ms << " ms, frame "
             << s.frame_ms << " ms";
    if (arguments.wants_picture() && s.is_encoded_while_drawn)
        text << " with encoding\n";
    else if (arguments.wants_picture())
        text << ", encode " << s.encode_ms << " ms\n";
    if (s.video)
        text << video_text(arguments, *s.video);
    if (s.sequence)
        text << sequence_text(arguments, *s.sequence);
    if (s.page)
        text << page_text(arguments.page, *s.page);
    if (s.bench)
        text << "bench: " << arguments.bench << " frames, minimum " << std::setprecision(2) << s.bench->min_ms
             << " ms, median " << s.bench->median_ms << " ms, " << s.bench->drawn_points << " points drawn, memory "
             << std::setprecision(1) << static_cast<double>(peak_memory()) / (1 << 20) << " MiB\n";
    return text.str();
}

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
std::optional<int> make_layers(const Arguments &arguments, ModelDrawer &drawer, const Camera &camera,
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
Result<Framebuffer> draw_turned(const Arguments &arguments, ModelDrawer &drawer, const Camera &camera) {
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
Result<std::uint64_t> visit_cost(const Arguments &arguments, const std::string &model, const Screen &screen) {
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
std::optional<int> make_page(const Arguments &arguments, ModelDrawer &drawer, const Camera &camera,
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
std::optional<int> make_picture(const Arguments &arguments, ModelDrawer &drawer, const Camera &camera, int threads,
                                RunStatistics &statistics) {
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
std::optional<int> make_video(const Arguments &arguments, ModelDrawer &drawer, VideoSink sink,
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
std::optional<int> make_sequence(const Arguments &arguments, ModelDrawer &drawer, RunStatistics &statistics) {
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
Result<PreparedModel> prepare(const Arguments &arguments) {
    command_line::ProgressDisplay display(arguments.view.verbosity);
    ScanOptions scans = arguments.scans;
    scans.fields = fields_to_keep(arguments.view.look);
    return prepare_model(arguments.input,
                         {.scans = scans,
                          .threads = arguments.view.load.threads,
                          .progress = [&](std::string_view step, double done) { display.show(step, done); }});
}

int run(Arguments arguments, std::span<std::byte> heap) {
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
        Arguments arguments;
        const std::optional<int> done = parse(argc, argv, arguments);
        if (done)
            return *done;
        return run(std::move(arguments), use_large_pages());
    });
}
