// Replaces what points know of the surface by what the mesh says: surface offsets, normals or both. Pictures then show
// what the format allows; what they gain over ordinary ones is what better estimates could gain.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/bricks/chunk_offsets.h"
#include "pbm_render/bricks/point_run.h"
#include "ray_caster.h"

#include <map>
#include <memory>
#include <optional>
#include <span>

namespace pbm {

// The mesh near a point, as a plane.
struct LocalPlane {
    glm::dvec3 normal; // unit length
    double offset;     // from the voxel's centre along the point's normal to the mesh, voxel edges
};

class SurfaceOracle {
  public:
    // `rays` must outlive the oracle.
    SurfaceOracle(const RayCaster &rays, const Grid &grid) : rays_(rays), grid_(grid) {}

    // The plane through the mesh below a disc that covers the voxel: fitted to rays against the point's normal, each
    // to the first triangle that faces outwards within kMaxOffset of the centre's plane. Empty where most rays meet
    // none.
    std::optional<LocalPlane> plane_at(const glm::dvec3 &centre, const glm::dvec3 &normal, double voxel) const;

    // Replaces the normals of all levels. Two-sided points keep theirs.
    void replace_normals(Model &model) const;

    // Replaces the surface offsets of runs; which points are redundant does not change. The offsets are those of this
    // oracle: it must outlive the runs.
    void replace_offsets(std::span<PointRun> runs);

  private:
    const RayCaster &rays_;
    Grid grid_;
    std::map<const ChunkView *, std::unique_ptr<ChunkOffsets>> offsets_;
};

} // namespace pbm
