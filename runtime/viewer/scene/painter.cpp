#include "viewer/scene/painter.h"

#include "pbm_render/shading/depth_cue.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pbm {

Painter::Painter(const ModelParameters &file, std::shared_ptr<const Surroundings> surroundings,
                 std::uint32_t chunk_points, int threads)
    : file_(file), surroundings_(std::move(surroundings)), chunk_points_(chunk_points), threads_(threads) {}

RenderStatistics Painter::draw(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                               Framebuffer &target) {
    if (look.options.quality == Quality::fast)
        return draw_fast(runs, camera, look, target);
    return with_depth_cue(camera, look.options.depth_cue, target, [&](Framebuffer &picture) {
        return prepare(fine_, fine_appearance_, look.appearance)
            .render(runs, camera, look.options.render, picture, look.options.samples);
    });
}

RenderStatistics Painter::draw_fast(std::span<const PointRun> runs, const Camera &camera, const Look &look,
                                    Framebuffer &target) {
    return with_depth_cue(camera, look.options.depth_cue, target, [&](Framebuffer &picture) {
        return prepare(fast_, fast_appearance_, look.appearance).render(runs, camera, look.options.render, picture);
    });
}

void Painter::begin_fine(std::span<const PointRun> runs, const Camera &camera, const Look &look, int width,
                         int height) {
    fine_camera_ = camera;
    fine_cue_ = look.options.depth_cue;
    prepare(fine_, fine_appearance_, look.appearance)
        .begin(runs, camera, look.options.render, Framebuffer(width, height, fine_cue_ != DepthCue::none));
}

RenderStatistics Painter::add_sample(Framebuffer &target) {
    const RenderStatistics drawn = fine_->add_sample();
    with_depth_cue(fine_camera_, fine_cue_, target, [&](Framebuffer &picture) {
        fine_->resolve(picture);
        return drawn;
    });
    return drawn;
}

template <class Renderer>
Renderer &Painter::prepare(std::optional<Renderer> &renderer, std::optional<Appearance> &last,
                           const Appearance &appearance) {
    if (!renderer)
        renderer.emplace(file_, chunk_points_, threads_, surroundings_);
    if (last != appearance) {
        renderer->set_appearance(appearance);
        last = appearance;
    }
    return *renderer;
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
    if (!pool_)
        pool_.emplace(resolve_threads(threads_));
    add_depth_cue(cue, camera, file_.grid.edge(), *pool_, picture);
    if (!has_depths)
        std::copy_n(picture.colour.begin(), target.pixels(), target.colour.begin());
    return drawn;
}

void add_depth_cue(DepthCue cue, const Camera &camera, double grid_edge, ThreadPool &pool, Framebuffer &target) {
    const double focal = target.height / 2.0 / std::tan(camera.view_angle / 2);
    apply_depth_cue(cue, {.focal = focal, .grid_edge = grid_edge}, pool, target);
}

} // namespace pbm
