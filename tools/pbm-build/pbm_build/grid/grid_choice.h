// Where the voxel grid lies and how fine it is. BVG.md section 3.4.
// Based on: Botsch, Wiratanaya, Kobbelt 2002, section 3.1: quantisation error and sampling density in balance
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <optional>
#include <span>
#include <string>

namespace pbm::build {

// On a coarser grid a splat of 5 % of the edge, the most that is allowed, could not cover a voxel: holes would open.
inline constexpr int kMinBuildDepth = 5;

// At most one of the first four is set; none asks for a voxel edge close to the sampling distance.
struct GridRequest {
    std::optional<int> depth;                // kMinBuildDepth..kMaxDepth
    std::optional<double> voxel_size;        // model units, > 0; the origin snaps to multiples of it
    std::optional<std::uint64_t> max_points; // the finest depth with at most so many points
    std::optional<Grid> like;                // this very grid, with its unit and up axis
    Unit unit = Unit::unknown;
    UpAxis up = UpAxis::y;
};

// Axis-aligned box of what will be sampled: the corners of triangles, and points.
struct Bounds {
    glm::dvec3 lowest{}, highest{};
    double extent() const; // longest edge
};
Bounds bounds_of(const Surface &surface);
Bounds bounds_of(std::span<const glm::dvec3> positions); // not empty
double farthest_coordinate(const Bounds &bounds);        // without its sign

// Refuses what cannot be put on a grid of doubles.
//
// errors  too_large  the box is longer than 1e30 or shorter than 1e-30 (but not zero) model units
Status check_bounds(const Bounds &bounds);

// A cube of 2^depth voxels per edge, centred on the box, a millionth wider than the box needs, so that nothing falls
// outside. A box without extent gets an edge of 1, or more where doubles are coarser than that.
Grid centred_grid(const Bounds &bounds, int depth);

// Voxels of exactly this size whose corners lie at multiples of it; the least depth that holds the box.
//
// errors  usage  more than kMaxDepth levels would be needed; voxels finer than doubles are at that place
Result<Grid> snapped_grid(const Bounds &bounds, double voxel_size);

// The grid of a .pbvg file.
//
// errors  io, and those of Reader::open (pbm_format/reading/reader.h)
Result<Grid> read_grid(const std::string &path);

// Nothing that is sampled may lie outside, so that no point is moved.
//
// errors  usage  something does; the grid is coarser than kMinBuildDepth
Status check_fits(const Bounds &bounds, const Grid &grid);

// Range of depths chosen by itself. A coarse mesh is sampled finer than its vertices: it should not look like bricks.
inline constexpr int kMinMeshDepth = 8, kMaxMeshDepth = 12;
inline constexpr int kMinPointDepth = 5, kMaxPointDepth = 14;

// Median length of the triangles' edges (an inner edge counts twice), to 2 %; 0 if every edge has length zero.
double median_edge(const Surface &surface, int threads);

// Depth whose voxel edge comes closest to the median edge length, as a ratio.
int mesh_depth(const Bounds &bounds, double median_edge);

// Number of voxels at depth 0..kMaxDepth of the centred grid that the surface's points occupy.
std::vector<std::uint64_t> occupied_voxels(const Surface &surface, const Bounds &bounds, int threads);

// Finest depth at which a level still has 11/6 times the voxels of the level above: a densely sampled surface has 4,
// and where points fall at random at 1.82 a voxel's face holds half a point on average. So the voxel edge is within a
// factor of sqrt(2) of the distance between points.
int point_depth(const std::vector<std::uint64_t> &occupied);

// Area of all triangles in units of the square of the centred grid's edge.
double relative_area(const Surface &surface, const Bounds &bounds, int threads);

// The grid that is asked for, with its unit and up axis, of a surface and its bounds; of meshes and points together the
// finer of what each asks for. With max_points the depth is an estimate from below: the surface may turn out to have
// more voxels.
//
// errors  usage  see snapped_grid and check_fits
Result<Grid> choose_grid(const Surface &surface, const Bounds &bounds, const GridRequest &request, int threads);

} // namespace pbm::build
