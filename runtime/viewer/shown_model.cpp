#include "viewer/shown_model.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

namespace pbm {

double error_of(const Detail &detail, double max_error) {
    // In the place of a chunk that is missing the level above it is drawn, whose voxels are twice as large.
    return detail.missing.empty() ? max_error : std::max(max_error, 2 * detail.missing.front().error);
}

Result<ShownModelPointer> ShownModel::open(const std::string &path, const ViewOptions &options,
                                           std::function<void()> arrived) {
    ShownModelPointer shown(new ShownModel(path, options));
    StreamingOptions streaming{.threads = options.load.threads, .max_memory = options.load.max_memory};
    // Chunks arrive faster than pictures are drawn: one call is enough for all that nobody has looked at.
    streaming.arrived = [&has_arrivals = shown->has_arrivals_, arrived = std::move(arrived)] {
        if (!has_arrivals.exchange(true))
            arrived();
    };
    auto scene = open_scene(path, std::move(streaming));
    if (!scene)
        return scene.error();
    shown->scene_ = std::move(*scene);
    const auto bounds = shown->streamed().bounds();
    if (!bounds)
        return bounds.error();
    shown->bounds_ = *bounds;
    const Reader &reader = shown->streamed().reader();
    shown->window_renderer_.emplace(reader.parameters(), reader.header().chunk_points, options.load.threads,
                                    shown->scene_->surroundings);
    // An unusable camera is told when there is a window to tell it.
    if (const auto camera = choose_camera(options, *bounds, shown->grid().up, options.resolution))
        shown->streamed().request(
            shown->streamed().choose(shown->view(*camera, options.resolution, options.max_error)).missing);
    return shown;
}

DetailView ShownModel::view(const Camera &camera, glm::ivec2 size, double max_error) const {
    return detail_view(options_, camera, size, max_error);
}

PictureStatistics ShownModel::draw_now(const Detail &detail, const DetailView &view, Framebuffer &target) {
    return draw(window_renderer_, detail, view, target);
}

PictureStatistics ShownModel::draw_in_background(const Detail &detail, const DetailView &view, Framebuffer &target) {
    return draw(background_renderer_, detail, view, target);
}

PictureStatistics ShownModel::draw(std::optional<FastRenderer> &renderer, const Detail &detail, const DetailView &view,
                                   Framebuffer &target) const {
    const auto begin = std::chrono::steady_clock::now();
    const Reader &reader = streamed().reader();
    if (!renderer)
        renderer.emplace(reader.parameters(), reader.header().chunk_points, options_.load.threads,
                         scene_->surroundings);
    PictureStatistics statistics;
    statistics.drawn = renderer->render(detail.runs, view.camera, options_.render, target);
    statistics.coarsest_level = statistics.drawn.level;
    for (const PointRun &run : detail.runs)
        statistics.coarsest_level = std::min(statistics.coarsest_level, run.level);
    statistics.error = error_of(detail, view.max_error);
    statistics.missing = detail.missing.size();
    statistics.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return statistics;
}

Loading begin_loading(BackgroundThread &background, const std::string &path, const ViewOptions &options) {
    return background.post([&background, path, options]() -> Result<ShownModelPointer> {
        try {
            return ShownModel::open(path, options, [&background] { background.wake(); });
        } catch (const std::bad_alloc &) {
            return Error{ErrorCode::memory, 0, "out of memory"};
        }
    });
}

void let_go(BackgroundThread &background, ShownModelPointer model) {
    if (model)
        background.post([model = std::move(model)]() mutable { model.reset(); });
}

} // namespace pbm
