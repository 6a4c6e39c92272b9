#include "model_drawer.h"

#include <glm/geometric.hpp>

#include <utility>

namespace pbm {

Result<std::unique_ptr<ModelDrawer>> ModelDrawer::open(const std::string &path, const ViewOptions &options,
                                                       std::shared_ptr<ThreadPool> pool) {
    auto scene =
        open_scene(path, {.threads = options.load.threads, .pool = pool, .max_memory = options.load.max_memory},
                   options.look, options.up);
    if (!scene)
        return scene.error();
    auto extent = (*scene)->model.bounds();
    if (!extent)
        return extent.error();
    return std::unique_ptr<ModelDrawer>(
        new ModelDrawer(path, options, std::move(*scene), std::move(*extent), std::move(pool)));
}

ModelDrawer::ModelDrawer(std::string path, const ViewOptions &options, std::unique_ptr<StreamedScene> scene,
                         Extent extent, std::shared_ptr<ThreadPool> pool)
    : path_(std::move(path)), options_(options), scene_(std::move(scene)), extent_(std::move(extent)),
      look_(options.look, scene_->model.reader().parameters(), up_of(options, grid()), scene_->unasked.depth_cue,
            scene_->has_one_colour) {
    if (options_.renderer == Renderer::fast)
        painter_.emplace(*scene_, options_.load.threads, std::move(pool));
}

bool ModelDrawer::has_surroundings() const {
    return scene_->surroundings->has_panorama() && scene_->drawn.ground.has_value();
}

LookOptions ModelDrawer::look() const {
    LookOptions look = look_.options;
    if (look_.depth_cue() != DepthCue::none)
        look.depth_cue = look_.depth_cue();
    if (!look.colour_by && !scene_->unasked.colour_by.empty())
        look.colour_by = ColourBy{.field = scene_->unasked.colour_by, .choice = {}};
    return look;
}

DetailView ModelDrawer::view(const Camera &camera, glm::ivec2 size, Motion motion) const {
    return detail_view(options_, camera, size, max_error_of(options_, size, look_.options.quality, motion));
}

Status ModelDrawer::load(const Camera &camera, glm::ivec2 size, Motion motion) {
    if (painter_) {
        const auto loaded = scene_->model.load(view(camera, size, motion));
        return loaded ? Status() : Status(loaded.error());
    }
    if (whole_)
        return {};
    auto whole = load_scene(path_, options_.load, scene_->colours, scene_->hidden.get());
    if (!whole)
        return whole.error();
    whole_ = std::move(*whole);
    return {};
}

RenderStatistics ModelDrawer::draw(const Camera &camera, Framebuffer &target, Motion motion, const RowTasks &tasks) {
    if (!painter_) {
        TableRenderer renderer = whole_->renderer;
        Appearance appearance = appearance_for(look_);
        if (scene_->colours)
            appearance.palette = scene_->colours->palette;
        renderer.set_appearance(appearance);
        const Finish &finish = look_.options.finish;
        const RenderStatistics drawn =
            renderer.render(camera, before_finish(finish, look_.options.render), target, {.splats = options_.splats});
        if (!finish.is_none())
            grade(finish, target);
        if (look_.depth_cue() != DepthCue::none) {
            ThreadPool pool(1);
            add_depth_cue(look_.depth_cue(), camera, grid().edge(), pool, target);
        }
        add_rest_of_finish(look_.options, camera, grid().unit, target);
        if (const auto legend = scene_->colours ? legend_of(*scene_->colours, scene_->hidden.get()) : std::nullopt;
            legend && options_.look.legend)
            draw_legend(*legend, target);
        for (std::size_t task = 0; task < tasks.count; ++task)
            tasks.run(task, 0);
        return drawn;
    }
    const Detail detail = scene_->model.choose(view(camera, {target.width, target.height}, motion));
    return painter_->draw(detail.runs, camera, look_, motion, target, tasks);
}

PictureLayers ModelDrawer::draw_layers(const Camera &camera, glm::ivec2 size, Motion motion, RenderStatistics &drawn) {
    const Detail detail = scene_->model.choose(view(camera, size, motion));
    PictureLayers layers = painter_->draw_layers(detail.runs, camera, look_, motion, size, drawn);
    count_depths_from(camera, layers.depth);
    return layers;
}

void ModelDrawer::count_depths_from(const Camera &camera, std::span<float> depths) const {
    const auto distance = [](const Camera &from) { return glm::length(from.focal_point - from.position); };
    const double moved = distance(telecentric(camera, grid().edge())) - distance(camera);
    if (camera.orthographic)
        for (float &depth : depths)
            depth = static_cast<float>(static_cast<double>(depth) - moved);
}

Status ModelDrawer::damage() const {
    const std::vector<Error> errors = scene_->surroundings->take_errors();
    return errors.empty() ? Status() : Status(errors.front());
}

} // namespace pbm
