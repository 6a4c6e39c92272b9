// The extent of a model, estimated from its coarse voxels without outlying specks, and cameras that show all of it: the
// default camera of every program, and cameras of other directions.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace pbm {

struct Sphere {
    glm::dvec3 centre{0};
    double radius = 0;
};

// Deepest level used for an extent. It has at most about 6,000 voxels, so that a first camera needs little loading.
inline constexpr int kBoundsLevel = 6;

// Voxels of this level are grouped into clusters: those that share a face, an edge or a corner are connected.
inline constexpr int kClusterLevel = 4;
// A cluster with fewer than 1 / kSpeckShare of the voxels is a speck. At least 1/16 of the grid's edge separates it
// from all other clusters. If all specks together hold more than 1 / kSpecksShare of the voxels, no speck is left out:
// the model is scattered.
inline constexpr std::size_t kSpeckShare = 64, kSpecksShare = 16;

struct Extent {
    // Encloses the occupied voxels of the level, without specks, and the discs that protrude from them; at most 0.2 %
    // larger than their smallest enclosing sphere. It is 1 to 2 % larger than the smallest sphere around the finest
    // voxels where few discs protrude, 5 % for a ball that fills the cube.
    Sphere sphere;
    // Corners of those voxels, model space, moved outwards where discs protrude. All vertices of the convex hull are
    // among them.
    std::vector<glm::dvec3> corners;
    // Cameras of the first view look from above, whatever its shape; find_extent leaves it to the caller.
    bool from_above = false;
};

// The data that find_extent needs of a model.
struct CoarseVoxels {
    std::span<const ByteView> masks; // [L]: the child masks of levels 1..level. BVG.md 4
    int level = 0;                   // 0..kBoundsLevel
    ByteView radii;                  // indices (BVG.md 6.2) of the level's points; empty: no disc protrudes
    ByteView hidden{};               // [points] 1: is left out, unless all are; empty: none
};
Extent find_extent(const Grid &grid, const CoarseVoxels &voxels);
// `levels`: the first ones of a model, from level 0 on. Uses the finest of them up to kBoundsLevel.
Extent find_extent(const Grid &grid, std::span<const Level> levels);
inline Extent find_extent(const Model &model) { return find_extent(model.parameters.grid, model.levels); }

// A framed model extends over this fraction of the way from the picture's middle to its border, along the axis on which
// the fraction is larger.
inline constexpr double kFramedPart = 0.95;

// Moves the camera, without turning it, so that the projection of the extent is centred in a picture of this size and
// as large as kFramedPart allows. The focal point lies in front of the camera, as far as the centre of the sphere.
Camera framed(const Camera &direction, const Extent &extent, int width, int height);

// The first view: horizontal, from front_direction, framed. Extents whose height along the up axis is less than a third
// of their length, like terrain, and those that ask for it are seen from 30 degrees above.
Camera default_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);
Camera default_camera(const Model &model, int width, int height, double view_angle = kDefaultViewAngle);

// The same direction, framed so that the model stays in the picture while it turns about the up axis. The focal point
// lies on the axis through the centre of the sphere.
Camera turntable_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);

// Looks from the front at a sphere, which touches the nearer borders of the picture.
Camera camera_around(const Sphere &sphere, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);

} // namespace pbm
