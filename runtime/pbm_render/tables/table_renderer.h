// The renderer of the dissertation, whose speed is the baseline of all figures: lookup tables replace what would be
// computed point by point. M * d for each child (TransformTable), which normals face away from an octant (mark_facing),
// a splat's shape for each normal in an octant, and on request the splat kernels (SplatKernels). Its pictures are those
// of the ReferenceRenderer, but for the splats whose shape is that of another place in their octant.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002, section 4;
// dissertation sections 4.2, 4.4 and 5.8
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace pbm {

class ModelSurroundings; // pbm_render/surroundings/frame_surroundings.h

// Shape of a drawn point: the exact image of a disc, or a stencil from the dissertation's table.
enum class Splats : std::uint8_t { ellipses, kernels };

struct TableOptions {
    int level = kMaxDepth; // detail level, clamped to the finest one of the model
    Splats splats = Splats::ellipses;
};

class TableRenderer {
  public:
    // `model` must be well formed (the reader verifies that), must not change and must outlive the renderer. It holds
    // all levels from the root to some level. Without `surroundings` the background has one colour.
    explicit TableRenderer(const Model &model, std::shared_ptr<const ModelSurroundings> surroundings = nullptr);

    // Sets the surface offsets of all points of a level, as SurfaceOffsets estimates them, from the next frame on. An
    // empty vector removes them.
    void set_offsets(int level, std::vector<std::int8_t> offsets);

    // Takes effect with the next frame: only per-frame tables depend on the appearance.
    void set_appearance(Appearance appearance) { appearance_ = std::move(appearance); }

    // Draws one frame; overwrites all of `target`, which must have depths. Depths are those of object and ground; the
    // panorama has none. The camera must be usable. Single-threaded and deterministic.
    RenderStatistics render(const Camera &camera, const RenderOptions &options, Framebuffer &target,
                            const TableOptions &own = {}) const;

  private:
    const Model &model_;
    const std::shared_ptr<const ModelSurroundings> surroundings_;
    Appearance appearance_;
    bool hides_points_ = false;                     // hide_points was called with the model
    std::vector<std::vector<std::int8_t>> offsets_; // [level][point]; empty: no offsets
    // [level][octant grid]: index of its first node; each level ends with a sentinel (subtree_starts).
    std::vector<std::vector<std::uint64_t>> octant_starts_;
};

} // namespace pbm
