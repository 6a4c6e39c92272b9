#include "viewer/scene/shown_model.h"

#include "viewer/cameras/model_views.h"

#include <algorithm>
#include <utility>

namespace pbm {

double error_of(const Detail &detail, double max_error) {
    // The level above replaces a missing chunk; its voxels are twice as large.
    return detail.missing.empty() ? max_error : std::max(max_error, 2 * detail.missing.front().error);
}

Result<ShownModelPointer> ShownModel::open(const std::string &path, const std::string &file, const ViewOptions &options,
                                           std::function<void()> arrived) {
    ShownModelPointer shown(new ShownModel(path, open_to_read(file), options));
    StreamingOptions streaming{.threads = options.load.threads, .max_memory = options.load.max_memory};
    // One call suffices for all arrivals that nobody has taken: chunks arrive faster than pictures are drawn.
    streaming.arrived = [&has_arrivals = shown->has_arrivals_, arrived = std::move(arrived)] {
        if (!has_arrivals.exchange(true))
            arrived();
    };
    auto scene = open_scene(file, std::move(streaming), options.look, options.up);
    if (!scene)
        return scene.error();
    shown->scene_ = std::move(*scene);
    auto extent = shown->streamed().bounds();
    if (!extent)
        return extent.error();
    shown->extent_ = std::move(*extent);
    static_cast<void>(shown->painter(shown->window_)); // now, before there is a window
    const double max_error = max_error_of(options, options.resolution, options.look.quality, Motion::still);
    // The window reports an unusable camera.
    if (const auto camera = choose_camera(options, shown->extent_, shown->grid(), options.resolution)) {
        const DetailView first = shown->view(*camera, options.resolution, max_error);
        shown->streamed().request(shown->streamed().choose(first).missing);
        if (options.view.empty() && !start_view(shown->streamed().reader().metadata()))
            shown->first_view_ = first;
    }
    return shown;
}

void ShownModel::draw_first(const std::function<bool()> &wait) {
    if (!first_view_)
        return;
    Detail detail = streamed().choose(*first_view_);
    while (!detail.missing.empty()) {
        if (!wait())
            return;
        take_arrivals();
        const bool was_loading = streamed().is_loading(); // the last chunk may arrive after the choice
        detail = streamed().choose(*first_view_);
        streamed().request(detail.missing);
        if (!detail.missing.empty() && !was_loading && !streamed().is_loading())
            return; // they are damaged, or memory is too small
    }
    Framebuffer pixels(first_view_->width, first_view_->height);
    const PictureStatistics drawn = draw_now(detail, *first_view_, first_look(), pixels);
    drawn_first_ = {*first_view_, std::move(pixels), drawn};
}

std::vector<Error> ShownModel::take_errors() {
    std::vector<Error> errors = streamed().take_errors();
    for (Error &error : scene_->surroundings->take_errors())
        errors.push_back(std::move(error));
    return errors;
}

DetailView ShownModel::view(const Camera &camera, glm::ivec2 size, double max_error) const {
    return detail_view(options_, camera, size, max_error);
}

template <class Draw>
PictureStatistics ShownModel::measure(const Detail &detail, const DetailView &view, const Draw &draw) const {
    const auto begin = std::chrono::steady_clock::now();
    PictureStatistics statistics;
    statistics.drawn = draw();
    statistics.coarsest_level = statistics.drawn.level;
    for (const PointRun &run : detail.runs)
        statistics.coarsest_level = std::min(statistics.coarsest_level, run.level);
    statistics.error = error_of(detail, view.max_error);
    statistics.missing = detail.missing.size();
    statistics.is_lost = is_overwritten();
    statistics.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return statistics;
}

PictureStatistics ShownModel::draw_now(const Detail &detail, const DetailView &view, const LookPointer &look,
                                       Framebuffer &target) {
    return measure(detail, view, [&] { return painter(window_).draw_fast(detail.runs, view.camera, *look, target); });
}

PictureStatistics ShownModel::draw_in_background(const Detail &detail, const DetailView &view, const LookPointer &look,
                                                 Framebuffer &target) {
    return measure(detail, view,
                   [&] { return painter(background_).draw_fast(detail.runs, view.camera, *look, target); });
}

PictureStatistics ShownModel::draw_frame(const Detail &detail, const DetailView &view, const LookPointer &look,
                                         Framebuffer &target) {
    return measure(detail, view,
                   [&] { return painter(window_).draw(detail.runs, view.camera, *look, Motion::moving, target); });
}

PictureStatistics ShownModel::draw_still(const Detail &detail, const DetailView &view, const LookPointer &look,
                                         Framebuffer &target) {
    return measure(detail, view,
                   [&] { return painter(background_).draw(detail.runs, view.camera, *look, Motion::still, target); });
}

void ShownModel::begin_fine(const Detail &detail, const DetailView &view, const LookPointer &look,
                            const Framebuffer &target) {
    painter(refining_).begin_fine(detail.runs, view.camera, *look, target);
}

PictureStatistics ShownModel::add_samples(const Detail &detail, const DetailView &view, int count, Framebuffer &target,
                                          const std::atomic<bool> *stop) {
    return measure(detail, view, [&] { return refining_->add_samples(count, target, stop); });
}

Painter &ShownModel::painter(std::optional<Painter> &made) const {
    if (!made)
        made.emplace(*scene_, options_.load.threads);
    return *made;
}

void destroy_in(ThreadPool &background, ShownModelPointer model) {
    if (model)
        background.post([model = std::move(model)]() mutable { model.reset(); });
}

} // namespace pbm
