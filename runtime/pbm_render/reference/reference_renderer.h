// The renderer that is easy to check: the dissertation's walk over the octree, one point after the other, every point
// of a level. An oracle for faster ones and the baseline of every speed figure. Based on: Botsch, Wiratanaya, Kobbelt
// 2002, section 4; dissertation sections 4.4 and 5.8
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/picture/render_options.h"
#include "pbm_render/surroundings/surroundings.h"

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace pbm {

class ReferenceRenderer {
  public:
    // `model` must be well formed (the reader has proven it), stay unchanged and outlive the renderer. Levels from
    // the root down to some level must be there; only those can be drawn. Without `surroundings` there is only the
    // background colour.
    explicit ReferenceRenderer(const Model &model, std::shared_ptr<const Surroundings> surroundings = nullptr);

    // Where in their voxels the surface lies at the points of a level, as SurfaceOffsets has it: splats of that level
    // move there from the next frame on. As many as the level has points; none takes them back.
    void set_offsets(int level, std::vector<std::int8_t> offsets);

    // From the next frame on: the tables of a frame are all that depends on it.
    void set_appearance(Appearance appearance) { appearance_ = std::move(appearance); }

    // Draws one frame into `target`, which has depths, whatever was there before: those of object and ground, the
    // panorama has none. The camera must be usable. One thread, deterministic.
    RenderStatistics render(const Camera &camera, const RenderOptions &options, Framebuffer &target) const;

  private:
    const Model &model_;
    const std::shared_ptr<const Surroundings> surroundings_;
    Appearance appearance_;
    std::vector<std::vector<std::int8_t>> offsets_; // [level], empty without
    // [level][octant grid]: index of its first node; one more entry at the end of each level (as subtree_starts).
    std::vector<std::vector<std::uint64_t>> octant_starts_;
};

} // namespace pbm
