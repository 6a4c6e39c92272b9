// Whether the light reaches the surface behind a point: shadow rays against the triangles a model was made from.
//
// A point stands for the piece of surface in its voxel, with one lit fraction for all of it. So its ray starts on the
// triangle nearest to the voxel's centre, a hundredth of a voxel above it on the light's side, and what it meets within
// the voxel's own extent does not count.
#pragma once

#include "pbm_format/model.h"
#include "triangle_mesh.h"

#include <memory>
#include <optional>
#include <span>

namespace pbm {

// Unit vector from `place` to the light, and how far that is (infinite for directional lights). Model space.
struct TowardsLight {
    glm::vec3 direction;
    float distance;
};
TowardsLight towards_light(const Light &light, const Grid &grid, const glm::dvec3 &place);

// What a point's voxel holds of the mesh.
struct SurfacePlace {
    glm::dvec3 position; // on the mesh, nearest to the voxel's centre; model space
    glm::vec3 normal;    // of the triangle, unit length, on the side of the point's own normal
    float distance;      // to the voxel's centre
};

class ShadowTruth {
  public:
    // `grid` is that of the models asked about.
    //
    // throws  std::runtime_error  no memory
    ShadowTruth(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles, const Grid &grid);
    ~ShadowTruth();
    ShadowTruth(const ShadowTruth &) = delete;
    ShadowTruth &operator=(const ShadowTruth &) = delete;

    SurfacePlace nearest(const glm::dvec3 &centre, const glm::vec3 &normal) const;

    // A ray from `place` to the light, `skip` of it left out at its start.
    bool reached(const SurfacePlace &place, const TowardsLight &light, float skip) const;

    // The same for any point of the light and any start, nothing left out: for ground planes and soft lights.
    bool reached(const glm::dvec3 &from, const TowardsLight &light) const;

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
    Grid grid_;
};

} // namespace pbm
