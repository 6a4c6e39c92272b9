#include "arguments.h"

#include "system/threads/parallel.h"
#include "viewer/cameras/camera_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pbm {

int fail_usage(const std::string &message) { return command_line::fail_usage(kProgram, message); }

namespace {

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

void add_camera_file(command_line::CommandLine &line, RenderArguments &arguments) {
    line.add("--camera-file",
             "Camera of a glTF file, and its animation: -o name_%04d.exr draws every frame (.png, .jpg)",
             &arguments.camera_file,
             {.type = "FILE.gltf|glb[,NAME]",
              .check = command_line::readable(parse_camera_file),
              .excludes = {"--camera-position", "--camera-focal-point", "--camera-view-up", "--camera-view-angle",
                           "--projection", "--view", "--turntable", "--avi"},
              .topic = "Camera"});
    line.add("--resume", "Keep frames of a sequence that are there", &arguments.resume,
             {.needs = "--camera-file", .topic = "Video"});
}

// The frames that are asked for; `path` and `given` are known.
Result<Sequence> sequence_of(const RenderArguments &arguments) {
    const auto names = parse_frame_names(arguments.output);
    if (!names)
        return names.error();
    if (arguments.thumbnail > 0 || !arguments.depth_output.empty() || !arguments.page.empty() || arguments.bench > 0)
        return usage_error("a sequence has no thumbnail, depth file, page or bench");
    if (arguments.given.contains("--frames") && !arguments.choice.part)
        return usage_error("--frames of a sequence is a part of it, like 1-40");
    const double fps = arguments.given.contains("--fps") ? arguments.video().fps
                                                         : arguments.path->rate.value_or(arguments.video().fps);
    const int all = frame_count(*arguments.path, fps);
    const std::string length = std::to_string(all) + " frames at " + to_string(Value(fps)) + " a second";
    if (all > kMaxFrames)
        return usage_error("the animation has " + length + ", more than " + std::to_string(kMaxFrames));
    FrameRange frames = arguments.choice.part.value_or(FrameRange{1, all});
    if (frames.first > all)
        return usage_error("--frames begins at " + std::to_string(frames.first) + ", and the animation has " + length);
    frames.last = std::min(frames.last, all);
    return Sequence{*arguments.path, fps, frames, *names, *arguments.form(), arguments.resume};
}

// Reads the camera file. Returns the exit code on failure.
std::optional<int> take_camera_file(RenderArguments &arguments) {
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

} // namespace

std::optional<int> parse(int argc, char **argv, RenderArguments &arguments) {
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

} // namespace pbm
