// Shadows by rays against the triangles that a model was made of. They are available while the model is built.
//
// Points alone do not say where the surface lies within a voxel: on rough scans 2 to 3 % of the points that face a
// light get wrong shadows. Triangles say it, and they hold the relief between points that blocks the light.
#pragma once

#include "pbm_bake/light_view.h"
#include "pbm_bake/triangle_tree.h"

#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

class ShadowRays {
  public:
    // `casters` and `triangles` must outlive this object.
    ShadowRays(const ShadowCasters &casters, const TriangleTree &triangles, int threads);

    // Whether every point lies on a triangle of its voxel. Otherwise the model is more than these triangles, and rays
    // would pass through the rest of it.
    bool complete() const { return complete_; }

    // A block of bricks is the unit of parallel work.
    std::size_t blocks() const;

    // For each point of a block, counts the parts of a light that a ray reaches, from the side of the point that faces
    // the light; 0 if that is the back of a point without two sides. Parts are
    // lights without size, in an order that spreads the first of them well: where those agree, the others are skipped.
    // A ray starts a quarter of a voxel off the surface, along the point's normal: voxels do not hold lower relief.
    // The surface is the position on the triangles nearest to the voxel's centre. Where scans overlap in layers up to
    // two voxels apart, it is the outermost layer, which is what is seen.
    void vote(std::size_t block, std::span<const LightPlace> parts, std::span<std::uint8_t> votes) const;

  private:
    struct Offset {
        std::int8_t x, y, z; // from the voxel's centre, in kOffsetSteps-ths of a voxel
        std::uint8_t layers; // of the outermost layer along the normal, in kLayerSteps-ths of a voxel
    };
    struct Start {
        Position front, back, normal; // on the outermost layer, and on the surface
        bool two_sides;
    };
    bool reached(const Start &from, const LightPlace &light) const;

    const ShadowCasters &casters_;
    const TriangleTree &triangles_;
    std::vector<Offset> offsets_; // [points]
    bool complete_ = true;
};

} // namespace pbm
