#include "viewer/scene/painter.h"

#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/shading/depth_cue.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pbm {
namespace {

// Sets the appearance of a renderer unless it is `last`.
template <class Renderer>
Renderer &with_appearance(Renderer &renderer, std::optional<Appearance> &last, const Appearance &appearance) {
    if (last != appearance) {
        renderer.set_appearance(appearance);
        last = appearance;
    }
    return renderer;
}

// Normals and numbers of the points that pixels show.
class PointNames {
  public:
    PointNames(std::span<const PointRun> runs, std::size_t materials) : runs_(runs), last_material_(materials - 1) {}

    // `ray`: from the eye to the point.
    std::array<float, 3> normal(const ShownPoint &shown, const glm::dvec3 &ray) const {
        const std::uint16_t stored = runs_[shown.run].chunk->normals[shown.point];
        const UnitVector &n = normal_table()[stored & kNormalIndexMask];
        const bool two_sided = (stored & kTwoSidedBit) != 0;
        const bool turned = shown.back || (two_sided && n[0] * ray.x + n[1] * ray.y + n[2] * ray.z > 0);
        const float sign = turned ? -1.0F : 1.0F;
        return {sign * static_cast<float>(n[0]), sign * static_cast<float>(n[1]), sign * static_cast<float>(n[2])};
    }
    PointNumbers numbers(const ShownPoint &shown) const {
        const PointRun &run = runs_[shown.run];
        const auto &materials = run.chunk->materials;
        const std::uint32_t point_of_chunk = run.origins != nullptr ? run.origins[shown.point] : shown.point;
        return {.level = static_cast<std::uint32_t>(run.level),
                .material = materials.empty() ? 0
                                              : static_cast<std::uint32_t>(
                                                    std::min<std::size_t>(materials[shown.point], last_material_)),
                .point = static_cast<std::uint32_t>(run.entry->first_point + point_of_chunk + 1)};
    }

  private:
    std::span<const PointRun> runs_;
    std::size_t last_material_;
};

// What a fast picture knows of a pixel's colour: that of the pixel's centre.
Float4 linear_of(std::uint32_t pixel, const ColourTable &colours) {
    const float alpha = static_cast<float>(pixel >> 24) / 255;
    return (colours.linear(pixel) + Float4{0, 0, 0, 1}) * alpha;
}

} // namespace

Painter::Painter(const StreamedScene &scene, int threads, std::shared_ptr<ThreadPool> pool)
    : scene_(scene), legend_(scene.colours ? legend_of(*scene.colours, scene.hidden.get()) : std::nullopt),
      threads_(threads), pool_(std::move(pool)) {}

Appearance Painter::appearance(const Look &look) const {
    Appearance appearance = appearance_for(look);
    if (scene_.colours)
        appearance.palette = scene_.colours->palette;
    return appearance;
}

void Painter::complete(const LookOptions &look, const Camera &camera, Framebuffer &target) const {
    add_rest_of_finish(look, camera, scene_.drawn.grid.unit, target);
    if (legend_ && look.legend)
        draw_legend(*legend_, target);
}

RenderStatistics Painter::draw(std::span<const PointRun> runs, const Camera &camera, const Look &look, Motion motion,
                               Framebuffer &target, const RowTasks &tasks) {
    if (!draws_fine(look.options.quality, motion))
        return draw_fast(runs, camera, look, target, tasks);
    const RenderOptions options = before_finish(look.options.finish, look.options.render);
    const RenderStatistics drawn = with_depth_cue(camera, look.depth_cue(), target, [&](Framebuffer &picture) {
        const RenderStatistics of_samples =
            fine(appearance(look)).render(runs, camera, options, picture, look.options.samples);
        grade_samples(look.options.finish, picture);
        return of_samples;
    });
    complete(look.options, camera, target);
    if (tasks.count > 0)
        pool().run(tasks.count, tasks.run);
    return drawn;
}

RenderStatistics Painter::draw_fast(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                                    Framebuffer &target, const RowTasks &tasks) {
    FastRenderer &renderer = fast(appearance(look));
    const RenderOptions options = before_finish(look.options.finish, look.options.render);
    if (look.depth_cue() == DepthCue::none && !legend_ && look.options.finish == Finish{})
        return renderer.render(runs, camera, options, target, tasks);
    const RenderStatistics drawn = with_depth_cue(camera, look.depth_cue(), target, [&](Framebuffer &picture) {
        const RenderStatistics of_picture = renderer.render(runs, camera, options, picture);
        if (!look.options.finish.is_none())
            grade(look.options.finish, picture);
        return of_picture;
    });
    complete(look.options, camera, target);
    pool().run(tasks.count, tasks.run); // cue, finish and legend change rows until the end
    return drawn;
}

PictureLayers Painter::draw_layers(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                                   Motion motion, glm::ivec2 size, RenderStatistics &drawn) {
    PictureLayers layers(size.x, size.y);
    Framebuffer centres(size.x, size.y, true);
    std::vector<ShownPoint> shown(centres.pixels());
    drawn = fast(appearance(look)).render(runs, camera, look.options.render, centres, {}, shown);
    if (draws_fine(look.options.quality, motion)) {
        Look unfinished = look;
        unfinished.options.finish = {};
        begin_fine(runs, camera, unfinished, centres);
        drawn = fine_->add_samples(look.options.samples);
        fine_->resolve(layers.colour);
    } else {
        const ColourTable colours;
        for (std::size_t at = 0; at < centres.pixels(); ++at)
            layers.colour[at] = linear_of(centres.colour[at], colours);
    }

    const Projection projection(telecentric(camera, scene_.drawn.grid.edge()), size.x, size.y);
    const PointNames names(runs, scene_.drawn.materials.size());
    for (std::size_t at = 0; at < centres.pixels(); ++at) {
        const auto depth = static_cast<double>(layers.depth[at] = centres.depth[at]);
        if (depth == std::numeric_limits<double>::infinity())
            continue;
        const glm::dvec3 ray = projection.ray(centres.centre(at)), place = projection.eye + depth * ray;
        layers.position[at] = {static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z)};
        if (shown[at].run == ShownPoint::kNone)
            continue; // the ground plane
        layers.normal[at] = names.normal(shown[at], ray);
        layers.numbers[at] = names.numbers(shown[at]);
    }
    return layers;
}

void Painter::begin_fine(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                         const Framebuffer &target) {
    fine_camera_ = camera;
    fine_cue_ = look.depth_cue();
    fine_look_ = look.options;
    fine(appearance(look)).begin(runs, camera, before_finish(fine_look_.finish, fine_look_.render), target);
}

RenderStatistics Painter::add_samples(int count, Framebuffer &target, const std::atomic<bool> *stop) {
    const RenderStatistics drawn = fine_->add_samples(count, stop);
    if (stop != nullptr && *stop)
        return drawn;
    with_depth_cue(fine_camera_, fine_cue_, target, [&](Framebuffer &picture) {
        fine_->resolve(picture);
        grade_samples(fine_look_.finish, picture);
        return drawn;
    });
    complete(fine_look_, fine_camera_, target);
    return drawn;
}

void Painter::grade_samples(const Finish &finish, Framebuffer &picture) const {
    if (finish.is_none())
        return;
    std::vector<Float4> light(picture.pixels()); // which a picture of 8 bits would cut off
    fine_->resolve(light);
    grade(finish, light, picture);
}

ThreadPool &Painter::pool() {
    if (pool_ == nullptr)
        pool_ = std::make_shared<ThreadPool>(resolve_threads(threads_));
    return *pool_;
}

FastRenderer &Painter::fast(const Appearance &appearance) {
    if (!fast_) {
        pool();
        fast_.emplace(scene_.drawn, scene_.model.reader().header().chunk_points, pool_, scene_.surroundings);
    }
    return with_appearance(*fast_, fast_appearance_, appearance);
}

FineRenderer &Painter::fine(const Appearance &appearance) {
    if (!fine_)
        fine_.emplace(scene_.drawn, scene_.model.reader().header().chunk_points, threads_, scene_.surroundings);
    return with_appearance(*fine_, fine_appearance_, appearance);
}

template <class Draw>
RenderStatistics Painter::with_depth_cue(const Camera &camera, DepthCue cue, Framebuffer &target, const Draw &draw) {
    if (cue == DepthCue::none)
        return draw(target);
    const bool has_depths = !target.depth.empty();
    if (!has_depths && (!depths_ || depths_->width != target.width || depths_->height != target.height))
        depths_.emplace(target.width, target.height, true);
    Framebuffer &picture = has_depths ? target : *depths_;
    const RenderStatistics drawn = draw(picture);
    add_depth_cue(cue, camera, scene_.drawn.grid.edge(), pool(), picture);
    if (!has_depths)
        std::copy_n(picture.colour.begin(), target.pixels(), target.colour.begin());
    return drawn;
}

void add_rest_of_finish(const LookOptions &look, const Camera &camera, Unit unit, Framebuffer &target) {
    if (!look.finish.is_none())
        add_background(look.finish, look.render, target);
    add_scale_bar(look.finish, view_height(camera) / target.height, unit, target);
}

void add_depth_cue(DepthCue cue, const Camera &camera, double grid_edge, ThreadPool &pool, Framebuffer &target) {
    const Camera drawn = telecentric(camera, grid_edge);
    const auto distance = [](const Camera &from) { return glm::length(from.focal_point - from.position); };
    const double focal = target.height / 2.0 / std::tan(drawn.view_angle / 2);
    apply_depth_cue(cue, {.focal = focal, .grid_edge = grid_edge, .relief = distance(drawn) / distance(camera)}, pool,
                    target);
}

} // namespace pbm
