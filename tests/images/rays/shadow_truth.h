// Whether light reaches the surface behind a point: shadow rays against the triangles a model was made from.
//
// A ray to the light starts 0.25 voxels above the place of the mesh nearest to the voxel's centre, along the point's
// normal: voxels do not resolve lower relief. Where scans overlap it starts at the outermost layer, which is the
// visible one. A strict ray starts 0.01 voxels above the triangle, so that all relief of the mesh shadows it.
#pragma once

#include "pbm_format/model/model.h"
#include "triangle_mesh.h"

#include <glm/vec3.hpp>

#include <memory>
#include <span>
#include <vector>

namespace pbm {

inline constexpr double kTruthLift = 0.25;    // voxels
inline constexpr double kFarthestLayer = 2.0; // voxels between the first layer and the last

// The place of the mesh that a point stands for.
struct SurfacePlace {
    glm::dvec3 position; // on the mesh, nearest to the voxel's centre, or on a layer above; model space
    glm::dvec3 normal;   // the point's
    glm::dvec3 facet;    // the triangle's, on the same side
    bool two_sided = false;
};

class ShadowTruth {
  public:
    // `centre` is subtracted from every position, so that single precision suffices for georeferenced meshes.
    //
    // throws  std::runtime_error  no memory
    ShadowTruth(const TriangleMesh &mesh, const glm::dvec3 &centre);
    ~ShadowTruth();
    ShadowTruth(const ShadowTruth &) = delete;
    ShadowTruth &operator=(const ShadowTruth &) = delete;

    // The place of the mesh nearest to `from`; its normal is that of the triangle.
    SurfacePlace nearest(const glm::dvec3 &from) const;
    // Moves `place` from layer to layer along its normal while these face the same way and lie within `reach`.
    void climb_layers(SurfacePlace &place, double reach) const;
    // Whether no triangle lies within `distance` (may be infinite) of `from` along `direction`.
    bool reaches(const glm::dvec3 &from, const glm::dvec3 &direction, double distance) const;

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

// Direction and distance from a place to a light. Directional lights are infinitely far away.
struct TowardsLight {
    glm::dvec3 direction; // unit length
    double distance = 0;
};
TowardsLight towards_light(const Light &light, const Grid &grid, const glm::dvec3 &place);

// Every `stride`-th point of the finest level.
struct SampledPoints {
    std::vector<std::size_t> points;
    std::vector<SurfacePlace> places;
};
SampledPoints sample_model(const ShadowTruth &truth, const Model &model, std::size_t stride, int threads);

// Figures of the points that face the light.
struct ShadowFigures {
    std::size_t facing = 0, lit = 0; // by rays
    std::size_t false_shadow = 0, false_light = 0;
    double cosines = 0, wrong_cosines = 0;               // sums of N.L, the possible light
    std::size_t facing_strictly = 0, wrong_strictly = 0; // strict rays; the triangle must face the light too
    double wrong() const {
        return facing == 0 ? 0 : static_cast<double>(false_shadow + false_light) / static_cast<double>(facing);
    }
    double wrong_light() const { return cosines > 0 ? wrong_cosines / cosines : 0; }
    double strictly_wrong() const {
        return facing_strictly == 0 ? 0 : static_cast<double>(wrong_strictly) / static_cast<double>(facing_strictly);
    }
};

// `baked`: one byte per point of the model, 0 in shadow.
ShadowFigures compare_shadows(const ShadowTruth &truth, const SampledPoints &sample, const Grid &grid,
                              const Light &light, ByteView baked, int threads);

// Figures of all points for each light with a shadow stream. A point counts as lit if its lit fraction exceeds 1/2.
std::vector<ShadowFigures> check_shadows(const ShadowTruth &truth, const Model &model, int threads);

} // namespace pbm
