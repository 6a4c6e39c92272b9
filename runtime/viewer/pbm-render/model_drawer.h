// Opens a model and draws it with one renderer; loads exactly what each picture needs.
#pragma once

#include "viewer/options/view_options.h"
#include "viewer/scene/painter.h"
#include "viewer/scene/scene.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace pbm {

class ModelDrawer {
  public:
    // Reads the coarsest levels. `options` say which renderer draws what, with how much memory, and with how many
    // threads unless `pool` gives them.
    static Result<std::unique_ptr<ModelDrawer>> open(const std::string &path, const ViewOptions &options,
                                                     std::shared_ptr<ThreadPool> pool = nullptr);

    const Extent &extent() const { return extent_; }
    const Grid &grid() const { return scene_->model.reader().parameters().grid; }
    // Whether the file has a panorama and a ground plane.
    bool has_surroundings() const;
    // The look that pictures have: as asked for, and where nobody asks as the model has it.
    LookOptions look() const;
    // Whether the renderer needs framebuffers with depths.
    bool needs_depths() const { return !painter_; }
    const std::string &path() const { return path_; }
    std::string_view metadata() const { return scene_->model.reader().metadata(); }
    std::uint64_t file_size() const { return scene_->file.bytes().size(); }

    // Loads what a picture of `size` needs: the whole level for --renderer reference.
    Status load(const Camera &camera, glm::ivec2 size, Motion motion);
    // Draws what was loaded for this view, and runs `tasks`. See Painter.
    RenderStatistics draw(const Camera &camera, Framebuffer &target, Motion motion, const RowTasks &tasks = {});
    // The same for programs that compose pictures; not with --renderer reference. Depths count from the camera's
    // position.
    PictureLayers draw_layers(const Camera &camera, glm::ivec2 size, Motion motion, RenderStatistics &drawn);
    // Turns the depths of a picture, which count from the eye, into distances from the camera's position along the view
    // direction. They differ if the camera is orthographic; what lies behind such a camera is drawn, too.
    void count_depths_from(const Camera &camera, std::span<float> depths) const;

    // The first error in rasters that pictures have read since the last call.
    Status damage() const;

    // What was read and decoded so far.
    StreamingStatistics cost() const { return whole_ ? whole_->cost : scene_->model.statistics(); }

  private:
    ModelDrawer(std::string path, const ViewOptions &options, std::unique_ptr<StreamedScene> scene, Extent extent,
                std::shared_ptr<ThreadPool> pool);
    DetailView view(const Camera &camera, glm::ivec2 size, Motion motion) const;

    const std::string path_;
    const ViewOptions options_;
    const std::unique_ptr<StreamedScene> scene_;
    const Extent extent_;
    const Look look_;                    // from the command line and the file
    std::optional<Painter> painter_;     // absent for --renderer reference
    std::shared_ptr<const Scene> whole_; // only for --renderer reference
};

} // namespace pbm
