// The renderer that is easy to check: the dissertation's walk over the octree draws every point of one level, one after
// the other. It is the oracle of the faster renderers and the baseline of every speed figure.
// Based on: Botsch, Wiratanaya, Kobbelt. 2002, section 4; dissertation, sections 4.4 and 5.8
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/picture/render_options.h"
#include "pbm_render/surroundings/frame_surroundings.h"

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace pbm {

// The shape of each drawn point: the exact image of a disc, or a stencil of the dissertation's table.
enum class Splats : std::uint8_t { ellipses, kernels };

struct ReferenceOptions {
    int level = kMaxDepth; // detail level; a level that the model does not hold stands for its finest one
    Splats splats = Splats::ellipses;
};

class ReferenceRenderer {
  public:
    // `model` must be well formed (the reader verifies that), stay unchanged and outlive the renderer. It holds all
    // levels from the root to some level; the renderer draws only these. Without `surroundings` the renderer fills the
    // background with one colour.
    explicit ReferenceRenderer(const Model &model, std::shared_ptr<const ModelSurroundings> surroundings = nullptr);

    // Sets the surface offsets of all points of a level, as SurfaceOffsets estimates them: from the next frame on
    // the renderer moves the splats of that level by them. An empty vector removes them.
    void set_offsets(int level, std::vector<std::int8_t> offsets);

    // Takes effect with the next frame: only tables that each frame computes depend on the appearance.
    void set_appearance(Appearance appearance) { appearance_ = std::move(appearance); }

    // Draws one frame into `target`, which must have depths, and overwrites all of it. Object and ground have depths;
    // the panorama has none. The camera must be usable. Uses one thread and is deterministic.
    RenderStatistics render(const Camera &camera, const RenderOptions &options, Framebuffer &target,
                            const ReferenceOptions &own = {}) const;

  private:
    const Model &model_;
    const std::shared_ptr<const ModelSurroundings> surroundings_;
    Appearance appearance_;
    std::vector<std::vector<std::int8_t>> offsets_; // [level][point]; empty: no offsets
    // [level][octant grid]: index of its first node; each level has one more entry at its end (subtree_starts).
    std::vector<std::vector<std::uint64_t>> octant_starts_;
};

} // namespace pbm
