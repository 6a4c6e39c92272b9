// The model of a file and the renderer that draws it, with exactly what its pictures need in memory.
#pragma once

#include "viewer/options/view_options.h"
#include "viewer/scene/painter.h"
#include "viewer/scene/scene.h"

#include <memory>
#include <optional>
#include <string>

namespace pbm {

class ModelDrawer {
  public:
    // Reads the coarsest levels; `options` say which renderer draws what, with how many threads and how much memory.
    static Result<std::unique_ptr<ModelDrawer>> open(const std::string &path, const ViewOptions &options);

    const Sphere &bounds() const { return bounds_; }
    const Grid &grid() const { return scene_->model.reader().parameters().grid; }
    // Whether the renderer draws only into pictures with depths.
    bool needs_depths() const { return !painter_; }
    // Of the file, bytes.
    std::uint64_t file_size() const { return scene_->file.bytes().size(); }

    // Loads what a picture of `size` needs: the reference renderer's level is all of it.
    Status load(const Camera &camera, glm::ivec2 size);
    // Draws what was loaded for this very view.
    RenderStatistics draw(const Camera &camera, Framebuffer &target);

    // Of rasters that pictures have seen so far, each found once.
    Status damage() const;

    // What was read and decoded so far.
    StreamingStatistics cost() const { return whole_ ? whole_->cost : scene_->model.statistics(); }

  private:
    ModelDrawer(std::string path, const ViewOptions &options, std::unique_ptr<StreamedScene> scene, Sphere bounds);
    DetailView view(const Camera &camera, glm::ivec2 size) const;

    const std::string path_;
    const ViewOptions options_;
    const std::unique_ptr<StreamedScene> scene_;
    const Sphere bounds_;
    const Look look_;                    // as the command line and the file say
    std::optional<Painter> painter_;     // or
    std::shared_ptr<const Scene> whole_; // for the reference renderer
};

} // namespace pbm
