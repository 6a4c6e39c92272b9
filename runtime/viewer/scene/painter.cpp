#include "viewer/scene/painter.h"

#include "pbm_render/shading/depth_cue.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
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

} // namespace

Painter::Painter(const StreamedScene &scene, int threads, std::shared_ptr<ThreadPool> pool)
    : scene_(scene), legend_(scene.colours ? legend_of(*scene.colours, scene.hidden) : std::nullopt), threads_(threads),
      pool_(std::move(pool)) {}

Appearance Painter::appearance(const Look &look) const {
    Appearance appearance = appearance_for(look);
    if (scene_.colours)
        appearance.palette = scene_.colours->palette;
    return appearance;
}

void Painter::add_legend(bool wanted, Framebuffer &target) const {
    if (legend_ && wanted)
        draw_legend(*legend_, target);
}

RenderStatistics Painter::draw(std::span<const PointRun> runs, const Camera &camera, const Look &look, Motion motion,
                               Framebuffer &target, const RowTasks &tasks) {
    if (!draws_fine(look.options.quality, motion))
        return draw_fast(runs, camera, look, target, tasks);
    const RenderStatistics drawn = with_depth_cue(camera, look.depth_cue(), target, [&](Framebuffer &picture) {
        return fine(appearance(look)).render(runs, camera, look.options.render, picture, look.options.samples);
    });
    add_legend(look.options.legend, target);
    if (tasks.count > 0)
        pool().run(tasks.count, tasks.run);
    return drawn;
}

RenderStatistics Painter::draw_fast(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                                    Framebuffer &target, const RowTasks &tasks) {
    FastRenderer &renderer = fast(appearance(look));
    if (look.depth_cue() == DepthCue::none && !legend_)
        return renderer.render(runs, camera, look.options.render, target, tasks);
    const RenderStatistics drawn = with_depth_cue(camera, look.depth_cue(), target, [&](Framebuffer &picture) {
        return renderer.render(runs, camera, look.options.render, picture);
    });
    add_legend(look.options.legend, target);
    pool().run(tasks.count, tasks.run); // cue and legend change rows until the end
    return drawn;
}

void Painter::begin_fine(std::span<const PointRun> runs, const Camera &camera, const Look &look, int width,
                         int height) {
    fine_camera_ = camera;
    fine_cue_ = look.depth_cue();
    fine_legend_ = look.options.legend;
    fine(appearance(look)).begin(runs, camera, look.options.render, Framebuffer(width, height));
}

RenderStatistics Painter::add_sample(Framebuffer &target, const std::atomic<bool> *stop) {
    const RenderStatistics drawn = fine_->add_sample(stop);
    if (stop != nullptr && *stop)
        return drawn;
    with_depth_cue(fine_camera_, fine_cue_, target, [&](Framebuffer &picture) {
        fine_->resolve(picture);
        return drawn;
    });
    add_legend(fine_legend_, target);
    return drawn;
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

void add_depth_cue(DepthCue cue, const Camera &camera, double grid_edge, ThreadPool &pool, Framebuffer &target) {
    const Camera drawn = telecentric(camera, grid_edge);
    const auto distance = [](const Camera &from) { return glm::length(from.focal_point - from.position); };
    const double focal = target.height / 2.0 / std::tan(drawn.view_angle / 2);
    apply_depth_cue(cue, {.focal = focal, .grid_edge = grid_edge, .relief = distance(drawn) / distance(camera)}, pool,
                    target);
}

} // namespace pbm
