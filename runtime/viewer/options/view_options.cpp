#include "viewer/options/view_options.h"

#include "command_line/common_options.h"
#include "pbm_format/model/las_classes.h"
#include "viewer/options/option_values.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace pbm {
namespace {

using command_line::CommandLine;
using command_line::Integers;
using command_line::Numbers;
using command_line::stored;

// Shortest text that reads back as the same number.
std::string number_text(double number) { return to_string(Value(number)); }

// Four digits are enough to read back the same bytes.
std::string colour_text(Rgba8 colour) {
    const auto part = [&](std::size_t channel) { return number_text(std::round(colour[channel] / 255.0 * 1e4) / 1e4); };
    return part(0) + "," + part(1) + "," + part(2);
}

std::string vector_text(const glm::dvec3 &v) {
    return number_text(v.x) + "," + number_text(v.y) + "," + number_text(v.z);
}

std::string clip_as_options(const ClipRegion &clip) {
    std::string text;
    if (clip.plane)
        text += " --clip-plane=" + vector_text(clip.plane->point) + "," + vector_text(clip.plane->normal);
    if (clip.box)
        text += " --clip-box=" + vector_text(clip.box->least) + "," + vector_text(clip.box->most);
    return text;
}

const std::vector<std::pair<std::string, Quality>> kQualities{
    {"auto", Quality::automatic}, {"fast", Quality::fast}, {"fine", Quality::fine}};
const std::vector<std::pair<std::string, std::optional<DepthCue>>> kDepthCues{
    {"none", DepthCue::none}, {"eye-dome", DepthCue::eye_dome}, {"ambient-occlusion", DepthCue::ambient_occlusion}};

const std::vector<std::pair<std::string, Backs>> kBacks{
    {"auto", Backs::automatic}, {"show", Backs::show}, {"hide", Backs::hide}};
const std::vector<std::pair<std::string, std::optional<LightsFollow>>> kLightsFollow{{"eye", LightsFollow::eye},
                                                                                     {"model", LightsFollow::model}};
const std::vector<std::pair<std::string, Shading>> kShadings{
    {"auto", Shading::automatic}, {"lit", Shading::lit}, {"unlit", Shading::unlit}};

const std::vector<std::pair<std::string, Tone>> kTones{{"none", Tone::none}, {"filmic", Tone::filmic}};

const std::vector<std::pair<std::string, std::optional<UpAxis>>> kUpAxes{
    {"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}};

template <class Value>
const std::string &word_of(const std::vector<std::pair<std::string, Value>> &choices, Value value) {
    return std::find_if(choices.begin(), choices.end(), [&](const auto &c) { return c.second == value; })->first;
}

void add_look_options(CommandLine &line, ViewOptions &options) {
    line.topic = "Look";
    command_line::add_choice(
        line, "--quality", "quality", kQualities, options.look.quality,
        "fast: one colour a point; fine: blended points; auto (default): fine, but fast in motion");
    line.add("--samples", "Of a pixel of fine pictures", &options.look.samples,
             {.check = Integers{1, kMaxSamples}, .shows_default = true});
    line.add("--level", "Finest detail level to draw; default, and above the depth: the finest there is",
             &options.load.max_level, {.check = Integers{0, kMaxDepth}});
    line.add("--max-error",
             "Largest edge of the voxels drawn, pixels; finer detail is left out; default 2, of fine pictures 1.42, "
             "and less below 1280x720",
             &options.max_error, {.check = Numbers{0.1, 64}});
    line.topic = "Points";
    line.add("--colour-by,--color-by",
             "Height, normal, plain, intensity, class, return or a field (pbm-build --field); default: height for "
             "clouds without colours; MAP: viridis, grey, classes",
             [&look = options.look, store = stored(parse_colour_by, options.look.colour_by)](const std::string &text) {
                 look.render.texture = look.render.point_colours = true;
                 return store(text);
             },
             {.type = "NAME[,MIN,MAX][,MAP]"});
    ClassChoice &classes = options.look.classes;
    const command_line::OptionRules list{.type = "LIST", .check = command_line::readable(parse_classes)};
    line.add("--drop-class", "Leave out points of these classes: numbers, or names such as noise,water",
             stored(parse_classes, classes.dropped), list);
    line.add("--show-class", "Draw points of these classes alone", stored(parse_classes, classes.shown), list);
}

// Each switch has a positive form, although on is the default: the dissertation's switches map to it.
void add_shading_options(CommandLine &line, LookOptions &look) {
    RenderOptions &render = look.render;
    line.topic = "Shading";
    line.add("--texture,!--no-texture", "Colours of the file's marble or wood; default on", &render.texture);
    line.add("--ignore-point-colours,--ignore-point-colors", "Draw points in the colour of their material",
             [&render] { render.point_colours = false; });
    line.add("--panorama,!--no-panorama", "The file's panorama behind everything; default on", &render.panorama);
    line.add("--ground,!--no-ground", "The file's ground plane; default on", &render.ground);
    line.add("--reflections,!--no-reflections", "Of the panorama, where a material asks for it; default on",
             &render.reflections);
    command_line::add_choice(line, "--depth-cue", "depth cue", kDepthCues, look.depth_cue,
                             "Shade by depth alone; default eye-dome for clouds without colours, else none");
    line.add("--legend,!--no-legend", "Of the colours of --colour-by; default on", &look.legend);
    line.add("--background-color,--background-colour",
             "sRGB, each 0..1; default 0.2,0.2,0.2; a second one: a gradient from top to bottom",
             [&render](const std::string &text) { return parse_background(text, render); }, {.type = "R,G,B[,R,G,B]"});
    line.topic = "Light";
    command_line::add_choice(
        line, "--shading", "shading", kShadings, render.shading,
        "unlit: the points' own colours; lit; auto (default): lit, softly where colours are those of photographs and "
        "no light is asked for");
    line.add("--shadows,!--no-shadows", "Shadows baked into the file; default on", &render.shadows);
    command_line::add_choice(
        line, "--light-follows", "light", kLightsFollow, look.lights_follow,
        "eye: lights turn with the camera and cast no shadows; model: they stay; default: those of the file "
        "stay, the default ones turn");
    line.add("--headlight",
             "One light that follows the camera in place of all others, degrees to the right of the eye and above it",
             stored(parse_headlight, look.headlight), {.type = "RIGHT,UP"});
    line.add("--exposure", "Light times 2^EV, of all but the background; .exr stays as it is", &look.finish.exposure,
             {.type = "EV", .check = Numbers{-kMaxExposure, kMaxExposure}, .shows_default = true});
    command_line::add_choice(line, "--tone", "tone curve", kTones, look.finish.tone,
                             "filmic: highlights approach white slowly; none (default): they are cut off");
}

} // namespace

std::vector<command_line::OldSwitch> old_switches(std::initializer_list<command_line::OldSwitch> more) {
    std::vector<command_line::OldSwitch> switches{{"-IGNORE_POINT_COLOURS", "--ignore-point-colours"},
                                                  {"-SHADOW", "--shadows"},
                                                  {"-TEXTURE", "--texture"},
                                                  {"-BACKGROUND", "--panorama"},
                                                  {"-ENVIRONMENT_MAP", "--reflections"}};
    switches.insert(switches.end(), more);
    return switches;
}

void add_view_options(CommandLine &line, ViewOptions &options) {
    line.add("--resolution", "Size of the picture; default 1280,720", stored(parse_resolution, options.resolution),
             {.type = "W,H"});
    line.topic = "Camera";
    const command_line::OptionRules vector{.type = "X,Y,Z"};
    line.add("--camera-position", "Default: in front of the model, so that all of it is seen",
             stored(parse_vector, options.position), vector);
    line.add("--camera-focal-point", "Default: the model's centre", stored(parse_vector, options.focal_point), vector);
    line.add("--camera-view-up", "Default: the up axis", stored(parse_vector, options.view_up), vector);
    line.add("--camera-view-angle", "Vertical angle of view, degrees", &options.view_angle,
             {.check = Numbers{0.01, 170}, .shows_default = true});
    command_line::add_choice(line, "--up", "axis", kUpAxes, options.up,
                             "Axis that points up in the first view and a turntable; default: the model's");
    command_line::add_choice<bool>(line, "--projection", "projection", {{"perspective", false}, {"orthographic", true}},
                                   options.orthographic,
                                   "perspective (default); orthographic: parallels stay parallel");
    line.add("--view", "A camera of the scan, which the model keeps; pbm-info lists them", &options.view,
             {.type = "NAME",
              .excludes = {"--camera-position", "--camera-focal-point", "--camera-view-up", "--camera-view-angle",
                           "--projection"}});
    line.add("--clip-plane", "Show the side of a plane that its normal leads to",
             stored(parse_clip_plane, options.clip.plane), {.type = "X,Y,Z,NX,NY,NZ"});
    line.add("--clip-box", "Show what lies between two corners", stored(parse_clip_box, options.clip.box),
             {.type = "X,Y,Z,X,Y,Z"});
    add_look_options(line, options);
    line.topic = "Shading";
    command_line::add_choice(
        line, "--backs", "choice", kBacks, options.backs,
        "Draw points that face away; hide: one sees into rooms; auto (default): unless the file says that its "
        "surface is closed");
    add_shading_options(line, options.look);
    line.topic = "Options";
    command_line::add_max_memory(line, options.load.max_memory);
    command_line::add_threads(line, options.load.threads);
    command_line::add_quiet(line, options.verbosity);
    command_line::add_verbose(line, options.verbosity, "Say where the camera stands");
}

void add_renderer_option(CommandLine &line, ViewOptions &options) {
    line.topic = "Look";
    command_line::add_choice<Renderer>(line, "--renderer", "renderer",
                                       {{"fast", Renderer::fast}, {"reference", Renderer::reference}}, options.renderer,
                                       "fast (default); reference: the dissertation's, draws every point of one level");
    command_line::add_choice<Splats>(line, "--splats", "kind of splat",
                                     {{"ellipses", Splats::ellipses}, {"kernels", Splats::kernels}}, options.splats,
                                     "With --renderer reference: ellipses (default); kernels: a table of stencils");
    line.topic = "Options";
}

namespace {

// `camera`: the default one for what lies in `bounds`.
Status refuse_far(const Sphere &bounds, const Camera &camera) {
    const glm::dvec3 corner = glm::abs(bounds.centre) + bounds.radius;
    const double farthest = std::max({corner.x, corner.y, corner.z});
    constexpr double kMaxRadii = 1e13; // beyond that, rounded coordinates move by a pixel
    if (is_usable(camera) && farthest <= kMaxRadii * bounds.radius)
        return {};
    return Error{ErrorCode::unsupported_feature, 0,
                 "the grid reaches " + number_text(farthest) +
                     " from the origin, too far to draw; build the model anew with --scale or --origin"};
}

} // namespace

Result<Camera> choose_camera(const ViewOptions &options, const Extent &extent, const Grid &grid, glm::ivec2 size) {
    Camera camera = default_camera(extent, up_of(options, grid), size.x, size.y, glm::radians(options.view_angle));
    if (const Status drawable = refuse_far(extent.sphere, camera); !drawable)
        return drawable.error();
    if (options.position) {
        camera.position = *options.position;
        camera.focal_point = extent.sphere.centre;
    }
    camera.focal_point = options.focal_point.value_or(camera.focal_point);
    camera.up = options.view_up.value_or(camera.up);
    if (options.orthographic && !options.position && !options.focal_point && is_usable(camera)) {
        camera.orthographic = true;
        camera = framed(camera, extent, size.x, size.y);
    }
    constexpr double kRoomForBar = 1.18; // below the model
    if (options.look.finish.scale_bar && !options.position && !options.focal_point)
        camera.position = camera.focal_point + kRoomForBar * (camera.position - camera.focal_point);
    camera.orthographic = options.orthographic;
    camera.clip = options.clip;
    camera.backs = options.backs;
    if (!is_usable(camera))
        return usage_error(
            "the camera sees nothing: it stands at its focal point or looks along its view-up, or a number is "
            "missing");
    return camera;
}

Result<Camera> choose_turntable(const ViewOptions &options, const Extent &extent, const Grid &grid, glm::ivec2 size) {
    if (options.position || options.focal_point || options.view_up)
        return choose_camera(options, extent, grid, size);
    const double angle = glm::radians(options.view_angle);
    Camera camera = turntable_camera(extent, up_of(options, grid), size.x, size.y, angle);
    if (const Status drawable = refuse_far(extent.sphere, camera); !drawable)
        return drawable.error();
    camera.clip = options.clip;
    camera.backs = options.backs;
    if (options.orthographic) { // shows the sphere around the model
        const double tangent = std::tan(angle / 2) * std::min(1.0, static_cast<double>(size.x) / size.y);
        const glm::dvec3 back = glm::normalize(camera.position - camera.focal_point);
        camera.orthographic = true;
        camera.focal_point = extent.sphere.centre;
        camera.position = camera.focal_point + extent.sphere.radius / tangent * back;
    }
    return camera;
}

void forget_camera(ViewOptions &options) {
    options.position = options.focal_point = options.view_up = std::nullopt;
    options.view.clear();
    options.up = std::nullopt;
    options.clip = {};
    options.look.colour_by = std::nullopt;
    options.look.classes = {};
}

double max_error_of(const ViewOptions &options, glm::ivec2 size, Quality quality, Motion motion) {
    return options.max_error.value_or(default_max_error(draws_fine(quality, motion), size.x, size.y));
}

DetailView detail_view(const ViewOptions &options, const Camera &camera, glm::ivec2 size, double max_error) {
    return {.camera = camera,
            .width = size.x,
            .height = size.y,
            .max_error = max_error,
            .finest = std::max(1, options.load.max_level)};
}

std::string view_as_options(const Camera &camera, const ViewOptions &options, glm::ivec2 size) {
    return "--resolution=" + std::to_string(size.x) + "," + std::to_string(size.y) +
           camera_as_options(camera, options.view_angle) + (options.up ? " --up=" + word_of(*options.up) : "");
}

std::string camera_as_options(const Camera &camera, double view_angle) {
    return " --camera-position=" + vector_text(camera.position) +
           " --camera-focal-point=" + vector_text(camera.focal_point) + " --camera-view-up=" + vector_text(camera.up) +
           " --camera-view-angle=" + number_text(view_angle) +
           (camera.orthographic ? " --projection=orthographic" : "") + clip_as_options(camera.clip) +
           (camera.backs == Backs::automatic ? "" : " --backs=" + word_of(camera.backs));
}

const std::string &word_of(Backs backs) { return word_of(kBacks, backs); }
const std::string &word_of(Shading shading) { return word_of(kShadings, shading); }
const std::string &word_of(LightsFollow follow) { return word_of(kLightsFollow, std::optional(follow)); }
const std::string &word_of(Tone tone) { return word_of(kTones, tone); }
const std::string &word_of(Quality quality) { return word_of(kQualities, quality); }
const std::string &word_of(DepthCue cue) { return word_of(kDepthCues, std::optional(cue)); }
const std::string &word_of(UpAxis up) { return word_of(kUpAxes, std::optional(up)); }

std::string look_as_options(const LookOptions &look) {
    const LookOptions standard;
    const RenderOptions &render = look.render;
    std::string text;
    const auto add_switch = [&](bool on, const char *option) { text += on ? "" : std::string(" ") + option; };
    add_switch(render.texture, "--no-texture");
    add_switch(render.point_colours, "--ignore-point-colours");
    add_switch(render.shadows, "--no-shadows");
    add_switch(render.panorama, "--no-panorama");
    add_switch(render.ground, "--no-ground");
    add_switch(render.reflections, "--no-reflections");
    if (look.colour_by)
        text += " --colour-by=" + colour_by_text(*look.colour_by);
    if (look.classes.dropped.any())
        text += " --drop-class=" + list_of(look.classes.dropped);
    if (look.classes.shown)
        text += " --show-class=" + list_of(*look.classes.shown);
    add_switch(look.legend, "--no-legend");
    if (render.shading != standard.render.shading)
        text += " --shading=" + word_of(render.shading);
    if (look.lights_follow)
        text += " --light-follows=" + word_of(*look.lights_follow);
    if (look.headlight)
        text += " --headlight=" + number_text(look.headlight->right) + "," + number_text(look.headlight->up);
    if (look.finish.exposure != 0)
        text += " --exposure=" + number_text(look.finish.exposure);
    if (look.finish.tone != standard.finish.tone)
        text += " --tone=" + word_of(look.finish.tone);
    if (look.finish.drop_shadow)
        text += " --drop-shadow";
    if (look.finish.scale_bar)
        text += " --scale-bar";
    if (look.finish.dpi != 0)
        text += " --dpi=" + std::to_string(look.finish.dpi);
    if (look.depth_cue)
        text += " --depth-cue=" + word_of(*look.depth_cue);
    if (look.quality != standard.quality)
        text += " --quality=" + word_of(look.quality);
    if (look.quality != Quality::fast && look.samples != standard.samples)
        text += " --samples=" + std::to_string(look.samples);
    if (render.background[3] == 0)
        text += " --no-background";
    else if (render.background != standard.render.background || render.background_below)
        text += " --background-color=" + colour_text(render.background) +
                (render.background_below ? "," + colour_text(*render.background_below) : "");
    return text;
}

std::string detail_as_options(const ViewOptions &options) {
    const ViewOptions standard;
    std::string text;
    if (options.max_error)
        text += " --max-error=" + number_text(*options.max_error);
    if (options.load.max_level != standard.load.max_level)
        text += " --level=" + std::to_string(options.load.max_level);
    return text;
}

void add_finish_options(CommandLine &line, Finish &finish) {
    line.add("--drop-shadow,!--no-drop-shadow", "A soft shadow of the model on the background; default off",
             &finish.drop_shadow, {.topic = "Look"});
    line.add("--scale-bar,!--no-scale-bar", "With its unit; in perspective of the focal point's plane; default off",
             &finish.scale_bar, {.topic = "Look"});
    line.add("--dpi", "Dots per inch of the picture in print; sizes the letters", &finish.dpi,
             {.check = Integers{10, kMaxDpi}, .topic = "Output"});
}

Status check_picture_memory(const ViewOptions &options) {
    const std::uint64_t bytes_per_pixel = 16 // colour, depth, two copies
                                          + (options.look.quality != Quality::fast ? 20 : 0) // sums of samples
                                          + (options.look.finish.is_none() ? 0 : 20)         // their light
                                          + (options.look.depth_cue.value_or(DepthCue::none) != DepthCue::none ? 8 : 0);
    const glm::ivec2 size = options.resolution;
    const auto pixels = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
    if (pixels * bytes_per_pixel <= options.load.max_memory)
        return {};
    return Error{ErrorCode::memory, 0,
                 "a picture of " + std::to_string(size.x) + "x" + std::to_string(size.y) +
                     " needs more than --max-memory; choose a smaller --resolution"};
}

} // namespace pbm
