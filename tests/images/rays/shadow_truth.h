// Whether light reaches the surface behind a point: shadow rays against the triangles a model was made from.
//
// A ray starts at the place of the mesh that is nearest to the voxel's centre, a quarter of a voxel above it along the
// point's normal, and goes to the light: relief lower than that is below what voxels hold of a surface. Where scans lie
// over each other it starts from the outermost of the layers, which is the one that a picture shows. Beside it the
// strict ray starts a hundredth of a voxel above the triangle, and all relief of the mesh shadows it.
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

// What a point's voxel holds of the mesh.
struct SurfacePlace {
    glm::dvec3 position; // on the mesh, nearest to the voxel's centre, or a layer above; model space
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

    // The place nearest to `from`; its normal is the triangle's.
    SurfacePlace nearest(const glm::dvec3 &from) const;
    // From layer to layer along `place.normal`, as long as they face the same way and are within `reach`.
    void climb_layers(SurfacePlace &place, double reach) const;
    // Nothing lies between `from` and what is `distance` (which may be infinite) away.
    bool reaches(const glm::dvec3 &from, const glm::dvec3 &direction, double distance) const;

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

// The way from a place to a light; the distance of directional lights is infinite.
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

// Of the points that face the light.
struct ShadowFigures {
    std::size_t facing = 0, lit = 0; // by rays
    std::size_t false_shadow = 0, false_light = 0;
    double cosines = 0, wrong_cosines = 0;               // sums of N.L: what the points could be lit with
    std::size_t facing_strictly = 0, wrong_strictly = 0; // strict rays, where the triangle faces the light, too
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

// One for each light of the model that has a shadow stream, all points; lit is what is so by more than half.
std::vector<ShadowFigures> check_shadows(const ShadowTruth &truth, const Model &model, int threads);

} // namespace pbm
