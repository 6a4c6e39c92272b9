// The plain renderer: draws the points of one detail level one after the other, without tables, SIMD or threads. It is
// the oracle of all other renderers, and what to read first. docs/explanation/rendering.md says why pictures are drawn
// so.
//
// BVG.md 4 (the octree whose child masks give the positions), 6 (normals, radii, colours, materials and shadows)
// Based on: dissertation sections 4.4 (traversal, projection, splats) and 4.6 (shading); Botsch, Wiratanaya, Kobbelt.
// Efficient High Quality Rendering of Point Sampled Geometry. 2002
// Stability: experimental.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace pbm {

class ModelSurroundings; // pbm_render/surroundings/frame_surroundings.h

class ReferenceRenderer {
  public:
    // `model` must be well formed (the reader verifies that), must not change and must outlive the renderer. It holds
    // all levels from the root to some level. Without `surroundings` the background has one colour.
    explicit ReferenceRenderer(const Model &model, std::shared_ptr<const ModelSurroundings> surroundings = nullptr)
        : model_(model), surroundings_(std::move(surroundings)), appearance_(model.parameters),
          offsets_(model.levels.size()) {}

    // Sets the surface offsets of all points of a level, as SurfaceOffsets estimates them, from the next frame on. An
    // empty vector removes them.
    void set_offsets(int level, std::vector<std::int8_t> offsets);

    // Takes effect with the next frame.
    void set_appearance(Appearance appearance) { appearance_ = std::move(appearance); }

    // Draws one frame of a detail level, which is clamped to the finest one of the model. Overwrites all of `target`,
    // which must have depths. Depths are those of object and ground; the panorama has none. The camera must be usable.
    // Single-threaded and deterministic. Of points at the same depth, the first of the level shows.
    RenderStatistics render(const Camera &camera, const RenderOptions &options, Framebuffer &target,
                            int level = kMaxDepth) const;

  private:
    const Model &model_;
    const std::shared_ptr<const ModelSurroundings> surroundings_;
    Appearance appearance_;
    std::vector<std::vector<std::int8_t>> offsets_; // [level][point]; empty: no offsets
};

} // namespace pbm
