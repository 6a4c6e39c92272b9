#include "drawing.h"

#include "pbm_format/model/las_classes.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_choice.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/shading/depth_cue.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm::c_api {
namespace {

// Rounds of fetching for one picture: each brings at least one finer level of chunks or tiles, or a part of it.
constexpr int kMaxRounds = 64;
static_assert(kCoarseLevel == kBoundsLevel);

glm::dvec3 vector_of(const double (&values)[3]) { return {values[0], values[1], values[2]}; }

void copy_to(double (&to)[3], const glm::dvec3 &from) {
    for (int axis = 0; axis < 3; ++axis)
        to[axis] = from[axis];
}

Status check_size(std::int32_t width, std::int32_t height) {
    if (width >= 1 && width <= kMaxPictureEdge && height >= 1 && height <= kMaxPictureEdge)
        return {};
    return usage_error("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                       " pixels; each is 1 .. " + std::to_string(kMaxPictureEdge));
}

bool is_finite(const glm::dvec3 &v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Result<Backs> backs_of(std::int32_t from) {
    switch (from) {
    case PBM_BACKS_AUTO: return Backs::automatic;
    case PBM_BACKS_SHOWN: return Backs::show;
    case PBM_BACKS_HIDDEN: return Backs::hide;
    default: return usage_error("camera.backs is " + std::to_string(from) + ", not 0, 1 or 2");
    }
}

Result<Camera> camera_of(const pbm_camera &from) {
    const Result<Backs> backs = backs_of(from.backs);
    if (!backs)
        return backs.error();
    Camera camera{.position = vector_of(from.position),
                  .focal_point = vector_of(from.focal_point),
                  .up = vector_of(from.up),
                  .view_angle = from.view_angle == 0 ? kDefaultViewAngle : from.view_angle,
                  .orthographic = from.orthographic != 0,
                  .clip = {},
                  .backs = *backs};
    if ((from.clip & ~static_cast<std::uint32_t>(PBM_CLIP_PLANE | PBM_CLIP_BOX)) != 0)
        return usage_error("camera.clip has unknown bits");
    if ((from.clip & PBM_CLIP_PLANE) != 0) {
        camera.clip.plane = {vector_of(from.plane_point), vector_of(from.plane_normal)};
        if (!is_finite(camera.clip.plane->point) || !is_finite(camera.clip.plane->normal))
            return usage_error("the camera's plane is not finite");
    }
    if ((from.clip & PBM_CLIP_BOX) != 0) {
        camera.clip.box = {vector_of(from.box_lowest), vector_of(from.box_highest)};
        if (!is_finite(camera.clip.box->least) || !is_finite(camera.clip.box->most))
            return usage_error("the camera's box is not finite");
    }
    if (!is_usable(camera))
        return usage_error(
            "the camera sees nothing: its position is its focal point, `up` lies along the line of sight, a "
            "value is not finite, the angle is not above 0 and below pi, or the normal of its plane is zero");
    return camera;
}

// What the options ask for of a picture; `request` has a camera and a size.
Status take_options(const pbm_render_options &options, Drawing::Request &request) {
    constexpr std::uint32_t kFlags = PBM_BACKGROUND | PBM_NO_TEXTURE | PBM_NO_COLOURS | PBM_NO_SHADOWS | PBM_NO_GROUND |
                                     PBM_NO_PANORAMA | PBM_NO_REFLECTIONS | PBM_HEADLIGHT | PBM_NO_LEGEND |
                                     PBM_GRADIENT;
    if (options.quality != PBM_FAST && options.quality != PBM_FINE)
        return usage_error("options.quality is " + std::to_string(options.quality) + ", neither PBM_FAST nor PBM_FINE");
    if (options.samples < 0 || options.samples > kMaxSamples)
        return usage_error("options.samples is " + std::to_string(options.samples) + ", not 1 .. " +
                           std::to_string(kMaxSamples));
    if (options.light_follows < PBM_LIGHTS_DEFAULT || options.light_follows > PBM_LIGHTS_MODEL)
        return usage_error("options.light_follows is " + std::to_string(options.light_follows) + ", which is nothing");
    if (options.shading < PBM_SHADING_AUTO || options.shading > PBM_UNLIT)
        return usage_error("options.shading is " + std::to_string(options.shading) + ", which is nothing");
    if ((options.flags & ~kFlags) != 0)
        return usage_error("options.flags has unknown bits");
    if (options.finest_level < 0 || options.finest_level > kMaxDepth)
        return usage_error("options.finest_level is " + std::to_string(options.finest_level) + ", not 1 .. " +
                           std::to_string(kMaxDepth));
    if (!(options.max_error >= 0 && std::isfinite(options.max_error)))
        return usage_error("options.max_error is no positive number of pixels");
    request.fine = options.quality == PBM_FINE;
    request.samples = options.samples == 0 ? kDefaultSamples : options.samples;
    switch (options.depth_cue) {
    case PBM_NO_CUE: break;
    case PBM_EYE_DOME: request.depth_cue = DepthCue::eye_dome; break;
    case PBM_AMBIENT_OCCLUSION: request.depth_cue = DepthCue::ambient_occlusion; break;
    case PBM_CUE_OFF: request.depth_cue = DepthCue::none; break;
    default: return usage_error("options.depth_cue is " + std::to_string(options.depth_cue) + ", which is none");
    }
    if (options.light_follows != PBM_LIGHTS_DEFAULT)
        request.lights_follow = options.light_follows == PBM_LIGHTS_EYE ? LightsFollow::eye : LightsFollow::model;
    if (options.finest_level > 0)
        request.view.finest = options.finest_level;
    request.view.max_error = options.max_error > 0
                                 ? options.max_error
                                 : default_max_error(request.fine, request.view.width, request.view.height);
    const auto leaves = [&](std::uint32_t flag) { return (options.flags & flag) != 0; };
    RenderOptions &render = request.render;
    if (leaves(PBM_BACKGROUND))
        std::copy_n(options.background, render.background.size(), render.background.begin());
    if (leaves(PBM_GRADIENT))
        std::copy_n(options.background_below, 4, render.background_below.emplace().begin());
    render.texture = !leaves(PBM_NO_TEXTURE);
    render.point_colours = !leaves(PBM_NO_COLOURS);
    render.shadows = !leaves(PBM_NO_SHADOWS);
    render.ground = !leaves(PBM_NO_GROUND);
    render.panorama = !leaves(PBM_NO_PANORAMA);
    render.reflections = !leaves(PBM_NO_REFLECTIONS);
    render.shading = static_cast<Shading>(options.shading); // in the same order
    request.legend = !leaves(PBM_NO_LEGEND);
    if (leaves(PBM_HEADLIGHT)) {
        const auto [right, up] = options.headlight;
        if (!(std::fabs(right) <= glm::pi<double>() && std::fabs(up) <= glm::half_pi<double>()))
            return usage_error("options.headlight is not -pi .. pi to the right and -pi/2 .. pi/2 above");
        request.headlight = {right, up};
    }
    return {};
}

// What the options ask for of all pictures.
Result<Drawing::Setup> setup_of(const pbm_render_options &options) {
    Drawing::Setup setup{.threads = options.threads};
    if (options.max_memory > 0)
        setup.max_memory = options.max_memory;
    for (const char *const list : {options.drop_class, options.show_class}) {
        if (list == nullptr || *list == 0)
            continue;
        const Result<std::bitset<256>> classes = parse_classes(list);
        if (!classes)
            return classes.error();
        if (list == options.drop_class)
            setup.classes.dropped = *classes;
        else
            setup.classes.shown = *classes;
    }
    if (options.colour_by == nullptr || *options.colour_by == 0)
        return setup;
    setup.colour_by = options.colour_by;
    switch (options.colour_map) {
    case PBM_MAP_AUTO: break;
    case PBM_MAP_VIRIDIS: setup.colours.map = ColourMap::viridis; break;
    case PBM_MAP_GREY: setup.colours.map = ColourMap::grey; break;
    case PBM_MAP_CLASSES: setup.colours.map = ColourMap::classes; break;
    default: return usage_error("options.colour_map is " + std::to_string(options.colour_map) + ", which is none");
    }
    const auto [least, most] = options.colour_range;
    if (least == 0 && most == 0)
        return setup;
    if (!(least < most && std::isfinite(least) && std::isfinite(most)))
        return usage_error("options.colour_range is not two ascending numbers");
    if (options.colour_map == PBM_MAP_CLASSES)
        return usage_error("options.colour_range: the colour map of classes has no range, each label has its colour");
    setup.colours.range = {least, most};
    return setup;
}

// Whether an array of `count` elements holds `rows` rows of `width`, each `stride` behind the one before.
Status check_rows(const char *name, std::size_t count, std::size_t width, std::size_t stride, std::size_t rows) {
    if (stride < width)
        return usage_error(std::string(name) + ": a stride of " + std::to_string(stride) + " is shorter than a row, " +
                           std::to_string(width));
    if (stride <= std::numeric_limits<std::size_t>::max() / rows && count >= stride * (rows - 1) + width)
        return {};
    return usage_error(std::string(name) + " is too short for the picture: it has " + std::to_string(count) +
                       " elements, and " + std::to_string(rows) + " rows of " + std::to_string(width) +
                       " with a stride of " + std::to_string(stride) + " are to lie there");
}

// Fills in the defaults of the strides.
Status check_picture(pbm_picture &picture) {
    if (Status sized = check_size(picture.width, picture.height); !sized)
        return sized;
    if (picture.pixels == nullptr && picture.depths == nullptr)
        return usage_error("picture.pixels is null");
    const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
    constexpr std::size_t kPixelBytes = 4;
    picture.stride = picture.stride == 0 ? kPixelBytes * width : picture.stride;
    picture.depth_stride = picture.depth_stride == 0 ? width : picture.depth_stride;
    if (picture.pixels != nullptr)
        if (Status rows =
                check_rows("picture.pixels", picture.pixel_bytes, kPixelBytes * width, picture.stride, height);
            !rows)
            return rows;
    return picture.depths == nullptr
               ? Status()
               : check_rows("picture.depths", picture.depth_count, width, picture.depth_stride, height);
}

double distance_of(const Camera &camera) { return glm::length(camera.focal_point - camera.position); }

// Copies the picture to the caller's arrays. Depths of an orthographic camera count from where the caller placed it.
void copy_picture(const Framebuffer &drawn, double moved, const pbm_picture &to) {
    const auto width = static_cast<std::size_t>(drawn.width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(drawn.height); ++y) {
        if (to.pixels != nullptr)
            std::memcpy(to.pixels + y * to.stride, drawn.colour.data() + y * width, width * sizeof(std::uint32_t));
        if (to.depths != nullptr)
            std::transform(drawn.depth.data() + y * width, drawn.depth.data() + (y + 1) * width,
                           to.depths + y * to.depth_stride,
                           [&](float depth) { return static_cast<float>(static_cast<double>(depth) - moved); });
    }
}

// The colours of points, and those that are left out. None while their bytes are missing.
Result<std::optional<Drawing::Fields>> fields_of(OpenModel &model, const Drawing::Setup &setup) {
    const Reader &reader = model.reader;
    Drawing::Fields fields;
    std::vector<FileRange> ranges =
        setup.colour_by.empty() ? one_colour_ranges(reader) : colour_sample_ranges(reader, setup.colour_by);
    if (!setup.classes.draws_all()) {
        Result<HiddenClasses> hidden = hidden_classes(reader.parameters(), setup.classes);
        if (!hidden)
            return hidden.error();
        fields.hidden = std::make_shared<const HiddenClasses>(std::move(*hidden));
        ranges.push_back(reader.section(SectionType::fields)->range());
    }
    const Result<FileBytes::Fetched> fetched = model.bytes.fetch(ranges);
    if (!fetched)
        return fetched.error();
    if (fetched->pending)
        return std::optional<Drawing::Fields>();
    if (!setup.colour_by.empty()) {
        Result<FieldColours> colours = choose_field_colours(model.reader, setup.colour_by, setup.colours);
        if (!colours)
            return colours.error();
        fields.colours = std::move(*colours);
    } else {
        const Result<bool> one = has_one_colour(model.reader); // a picture tells of damage
        fields.has_one_colour = one && *one;
    }
    return std::optional(std::move(fields));
}

// The drawing of an open model.
Result<Drawing *> drawing_of(OpenModel &model, Drawing::Setup setup) {
    if (setup.colour_by.empty())
        setup.colour_by = unasked_look(model.reader).colour_by;
    const auto is_open = [&] { return model.drawing != nullptr && model.drawing->setup() == setup; };
    if (Status checked = check_threads(setup.threads); !checked)
        return checked.error();
    if (is_open())
        return model.drawing.get();
    Result<std::optional<Drawing::Fields>> fields = fields_of(model, setup);
    if (!fields && !is_damage(fields.error().code))
        return fields.error();
    if (!fields || !*fields) {
        setup.colour_by.clear();
        setup.colours = {};
        setup.classes = {};
        setup.has_fields = !fields;
    }
    if (!is_open()) {
        model.drawing.reset();
        auto opened = Drawing::open(model.bytes, setup, fields && *fields ? std::move(**fields) : Drawing::Fields());
        if (!opened)
            return opened.error();
        model.drawing = std::move(*opened);
    }
    if (!fields)
        model.drawing->add_damage(std::move(fields).error());
    return model.drawing.get();
}

Status choose_camera(OpenModel &model, std::int32_t width, std::int32_t height, pbm_camera *to) {
    return fill_structure(to, "camera", [&](pbm_camera &camera) -> Status {
        if (Status sized = check_size(width, height); !sized)
            return sized;
        const Result<std::span<const Level>> levels = model.coarse_levels();
        if (!levels)
            return levels.error();
        const Grid &grid = model.reader.parameters().grid;
        Extent extent = find_extent(grid, *levels);
        extent.from_above = unasked_look(model.reader).from_above;
        const Camera chosen = default_camera(extent, grid.up, width, height);
        copy_to(camera.position, chosen.position);
        copy_to(camera.focal_point, chosen.focal_point);
        copy_to(camera.up, chosen.up);
        camera.view_angle = chosen.view_angle;
        camera.orthographic = 0;
        camera.clip = 0;
        camera.backs = PBM_BACKS_AUTO;
        return {};
    });
}

Status draw_picture(OpenModel &model, const pbm_camera *given_camera, const pbm_render_options *given_options,
                    const pbm_picture *given_picture) {
    const Result<pbm_camera> c_camera = read_structure(given_camera, "camera");
    if (!c_camera)
        return c_camera.error();
    const Result<Camera> camera = camera_of(*c_camera);
    if (!camera)
        return camera.error();
    Result<pbm_picture> picture = read_structure(given_picture, "picture");
    if (!picture)
        return picture.error();
    if (Status checked = check_picture(*picture); !checked)
        return checked;
    Drawing::Request request{.view = {.camera = *camera, .width = picture->width, .height = picture->height},
                             .render = {}};
    Result<Drawing::Setup> setup = Drawing::Setup();
    if (given_options != nullptr) {
        const Result<pbm_render_options> options =
            read_structure(given_options, "options", offsetof(pbm_render_options, colour_range));
        if (!options)
            return options.error();
        if (Status taken = take_options(*options, request); !taken)
            return taken;
        setup = setup_of(*options);
        if (!setup)
            return setup.error();
    }
    const Result<Drawing *> drawing = drawing_of(model, std::move(*setup));
    if (!drawing)
        return drawing.error();
    Framebuffer drawn(picture->width, picture->height,
                      picture->depths != nullptr || (*drawing)->cue_of(request) != DepthCue::none);
    if (Status done = (*drawing)->draw(request, drawn); !done)
        return done;
    const double moved =
        camera->orthographic ? distance_of(telecentric(*camera, (*drawing)->grid().edge())) - distance_of(*camera) : 0;
    copy_picture(drawn, moved, *picture);
    return (*drawing)->shortfall();
}

} // namespace

Drawing::Drawing(const FileBytes &bytes, Reader reader, const Setup &setup, Fields fields,
                 const std::shared_ptr<ThreadPool> &pool)
    : bytes_(bytes), setup_(setup), pool_(pool), fields_(std::move(fields)),
      model_(std::move(reader), {.threads = setup.threads,
                                 .pool = pool,
                                 .max_memory = setup.max_memory,
                                 .field = fields_.colours,
                                 .hidden = fields_.hidden}),
      unasked_(unasked_look(model_.reader())),
      drawn_(fields_.colours ? with_field_colours(model_.reader().parameters(), *fields_.colours)
                             : model_.reader().parameters()) {}

Result<std::unique_ptr<Drawing>> Drawing::open(const FileBytes &bytes, const Setup &setup, Fields fields) {
    Result<Reader> reader = open_reader(bytes);
    if (!reader)
        return reader.error();
    const auto pool = std::make_shared<ThreadPool>(resolve_threads(setup.threads));
    return std::unique_ptr<Drawing>(new Drawing(bytes, std::move(*reader), setup, std::move(fields), pool));
}

// Opens the surroundings as soon as their directories have arrived.
Status Drawing::open_surroundings() {
    if (has_surroundings_)
        return {};
    const Result<FileBytes::Fetched> fetched = bytes_.fetch(raster_ranges(model_.reader()));
    if (!fetched)
        return fetched.error();
    if (fetched->pending)
        return {};
    has_surroundings_ = true;
    Result<TiledImages> images = read_images(model_.reader());
    if (!images) {
        add_damage(images.error());
        return {};
    }
    surroundings_ = std::make_shared<const Surroundings>(model_.reader().parameters(), std::move(*images));
    fast_.reset();
    fine_.reset();
    fine_picture_.reset();
    return {};
}

Result<Detail> Drawing::load(const DetailView &view) {
    lacks_memory_.reset();
    for (int round = 0;;) {
        Result<Detail> detail = model_.load(view);
        if (!detail && detail.error().code == ErrorCode::memory) {
            lacks_memory_ = detail.error();
            bytes_.limit_memory(setup_.max_memory);
            return model_.choose(view);
        }
        if (!detail) { // a damaged part, which the model loads but once
            add_damage(detail.error());
            continue;
        }
        if (detail->wanted.empty() || round++ == kMaxRounds)
            return detail;
        const Result<FileBytes::Fetched> fetched = bytes_.fetch(detail->wanted);
        if (!fetched)
            return fetched.error();
        if (!fetched->any_arrived)
            return detail;
    }
}

Appearance Drawing::appearance(const Request &request) const {
    Appearance appearance(model_.reader().parameters());
    appearance.has_one_colour = fields_.has_one_colour;
    appearance.lights_follow = request.lights_follow.value_or(appearance.lights_follow);
    if (request.headlight)
        set_headlight(appearance, (*request.headlight)[0], (*request.headlight)[1]);
    if (fields_.colours)
        appearance.palette = fields_.colours->palette;
    return appearance;
}

void Drawing::render(const Detail &detail, const Request &request, Framebuffer &target) {
    const Camera &camera = request.view.camera;
    if (request.fine) {
        render_fine(detail, request, target);
    } else {
        if (!fast_)
            fast_.emplace(drawn_, model_.reader().header().chunk_points, pool_, surroundings_);
        fast_->set_appearance(appearance(request));
        fast_->render(detail.runs, camera, request.render, target);
    }
}

void Drawing::render_fine(const Detail &detail, const Request &request, Framebuffer &target) {
    if (!fine_)
        fine_.emplace(drawn_, model_.reader().header().chunk_points, pool_, surroundings_);
    FinePicture picture{.view = request.view,
                        .options = request.render,
                        .appearance = appearance(request),
                        .with_depths = !target.depth.empty(),
                        .chunks = detail.chunks};
    if (fine_picture_ != picture || fine_->samples() > request.samples) {
        fine_->set_appearance(picture.appearance);
        fine_->begin(detail.runs, request.view.camera, request.render, target);
        fine_picture_ = std::move(picture);
    }
    fine_->add_samples(request.samples - fine_->samples());
    fine_->resolve(target);
}

Status Drawing::draw(const Request &request, Framebuffer &target) {
    if (fine_picture_ && !(request.fine && fine_picture_->view == request.view))
        fine_picture_.reset(); // and with it the chunks that only it holds
    const Result<Detail> detail = load(request.view);
    if (!detail)
        return detail.error();
    if (Status opened = open_surroundings(); !opened)
        return opened;
    for (int round = 0;; ++round) {
        render(*detail, request, target);
        const std::vector<FileRange> wanted =
            surroundings_ ? surroundings_->take_wanted() : std::vector<FileRange>(); // tiles
        if (wanted.empty() || round == kMaxRounds)
            break;
        fine_picture_.reset(); // it lacks tiles
        const Result<FileBytes::Fetched> fetched = bytes_.fetch(wanted);
        if (!fetched)
            return fetched.error();
        if (!fetched->any_arrived)
            break;
    }
    if (surroundings_)
        for (Error &error : surroundings_->take_errors())
            add_damage(std::move(error));
    if (cue_of(request) != DepthCue::none) {
        const Camera &camera = request.view.camera;
        const Camera drawn = telecentric(camera, grid().edge());
        apply_depth_cue(cue_of(request),
                        {.focal = target.height / 2.0 / std::tan(drawn.view_angle / 2),
                         .grid_edge = grid().edge(),
                         .relief = distance_of(drawn) / distance_of(camera)},
                        *pool_, target);
    }
    if (const auto legend = fields_.colours ? legend_of(*fields_.colours, fields_.hidden.get()) : std::nullopt;
        legend && request.legend)
        draw_legend(*legend, target);
    return {};
}

} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_default_camera(pbm_model *model, int32_t width, int32_t height, pbm_camera *camera, pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model",
                            [&](OpenModel &open) { return choose_camera(open, width, height, camera); });
    });
}

pbm_code pbm_render(pbm_model *model, const pbm_camera *camera, const pbm_render_options *options,
                    const pbm_picture *picture, pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model",
                            [&](OpenModel &open) { return draw_picture(open, camera, options, picture); });
    });
}
