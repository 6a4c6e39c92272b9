// What a first view must show: where a model is, by its coarse voxels and without its specks. And cameras that see all
// of it: the default camera of every program, and those of other directions.
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

// Deepest level used for an extent, at most about 6,000 voxels: a view is chosen before much is loaded.
inline constexpr int kBoundsLevel = 6;

// Voxels of this level that touch, also by an edge or a corner, are of one cluster.
inline constexpr int kClusterLevel = 4;
// A cluster with fewer than 1/64 of the voxels is a speck: it lies at least 1/16 of the grid's edge from all others.
// If specks held more than 1/16 of the voxels together, there are none: the model is scattered.
inline constexpr std::size_t kSpeckShare = 64, kSpecksShare = 16;

struct Extent {
    // Around the occupied voxels of the level and discs that stand out of them, specks left out, and so around what the
    // model shows; at most 0.2 % larger than their smallest sphere. That is 1 to 2 % larger than the smallest sphere of
    // the finest voxels where few stand out, 5 % for a ball that fills the cube.
    Sphere sphere;
    // Corners of those voxels, in model space, moved outwards where discs stand out: all corners of their convex hull
    // are among them.
    std::vector<glm::dvec3> corners;
};

// What is read of a model to find its extent.
struct CoarseVoxels {
    std::span<const ByteView> masks; // [L]: the child masks of levels 1..level. BVG.md 4
    int level = 0;                   // 0..kBoundsLevel
    ByteView radii;                  // indices (BVG.md 6.2) of the level's points; empty: no disc stands out
};
Extent find_extent(const Grid &grid, const CoarseVoxels &voxels);
// Of levels 0 and so on of a model: uses the finest one, at most kBoundsLevel.
Extent find_extent(const Grid &grid, std::span<const Level> levels);
inline Extent find_extent(const Model &model) { return find_extent(model.parameters.grid, model.levels); }

// A framed model reaches to this part of the way from the picture's middle to its border, along the axis on which it
// reaches farther.
inline constexpr double kFramedPart = 0.95;

// Moves the camera, without turning it, so that the projection of the extent is centred in a picture of this size and
// as large as kFramedPart allows. The focal point lies in front of the camera, as far as the centre of the sphere.
Camera framed(const Camera &direction, const Extent &extent, int width, int height);

// The first view: level, from the front (front_direction), framed. Models whose height along the up axis is less than a
// third of their length, as terrain is, are seen from 30 degrees above.
Camera default_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);
Camera default_camera(const Model &model, int width, int height, double view_angle = kDefaultViewAngle);

// The same direction, framed so that the model stays in the picture while it turns about the up axis. The focal point
// lies on the axis through the centre of the sphere.
Camera turntable_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);

// Looks from the front at a sphere, which touches the nearer borders of the picture.
Camera camera_around(const Sphere &sphere, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);

} // namespace pbm
