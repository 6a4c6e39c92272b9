// Shadows by rays against the triangles that a model was made of, where they are at hand: when it is built.
//
// Points alone do not say where within its voxel the surface lies; of rough scans 2 to 3 % of the points that face a
// light are wrong whatever is done with them. The triangles say it, and what relief between points stops the light.
#pragma once

#include "pbm_bake/light_view.h"
#include "pbm_bake/triangle_tree.h"

#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

class ShadowRays {
  public:
    // Both must outlive this.
    ShadowRays(const ShadowCasters &casters, const TriangleTree &triangles, int threads);

    // Every point stands on a triangle of its voxel. Else the model is more than these triangles, and rays would pass
    // through the rest of it.
    bool complete() const { return complete_; }

    // Bricks are asked in blocks, for threads to share.
    std::size_t blocks() const;

    // For each point of a block, from how many parts of a light a ray reaches it: 0 where it faces none. Parts are
    // lights without size, in an order that spreads the first of them well: where those agree the others do. A ray
    // starts a quarter of a voxel above the place of the triangles that is nearest to the voxel's centre, along the
    // point's normal: relief lower than that is below what voxels hold. Where scans lie over each other in layers up to
    // two voxels apart it starts above the outermost of them, which is what is seen.
    void vote(std::size_t block, std::span<const LightPlace> parts, std::span<std::uint8_t> votes) const;

  private:
    struct Offset {
        std::int8_t x, y, z; // from the voxel's centre, in kOffsetSteps-ths of a voxel
        std::uint8_t layers; // to the outermost layer along the normal, in kLayerSteps-ths of a voxel
    };
    struct Start {
        Place place, normal;
        bool two_sided;
    };
    bool reached(const Start &from, const LightPlace &light) const;

    const ShadowCasters &casters_;
    const TriangleTree &triangles_;
    std::vector<Offset> offsets_; // [points]
    bool complete_ = true;
};

} // namespace pbm
