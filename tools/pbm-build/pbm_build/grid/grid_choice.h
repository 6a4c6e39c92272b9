// Chooses origin and depth of the voxel grid. BVG.md 3.4.
// Based on: Botsch, Wiratanaya, Kobbelt 2002, section 3.1: quantisation error and sampling density in balance
#pragma once

#include "pbm_build/images/relief.h"
#include "pbm_build/surface/short_normal.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <optional>
#include <span>
#include <string>

namespace pbm::build {

// On a coarser grid the largest splat, 5 % of the edge, does not cover a voxel.
inline constexpr int kMinBuildDepth = 5;

// At most one of the first four is set. Default: a voxel edge close to the sampling distance, or half of it where the
// surface has that much detail.
struct GridRequest {
    std::optional<int> depth;                // kMinBuildDepth..kMaxDepth
    std::optional<double> voxel_size;        // model units, > 0; the origin snaps to multiples of it
    std::optional<std::uint64_t> max_points; // the finest depth with at most so many points
    std::optional<Grid> like;                // this very grid, with its unit and up axis
    std::optional<Unit> unit;                // absent: that of the scan's format, and none in choose_grid
    std::optional<UpAxis> up;     // absent: that of the scan's format, or found by find_up_axis, and +Y in choose_grid
    std::uint64_t scan_bytes = 0; // of the input files: a model whose depth is not given may weigh as much
};

// Axis-aligned box around everything that will be sampled: corners of triangles, and points.
struct Bounds {
    glm::dvec3 lowest{}, highest{};
    double extent() const; // longest edge
};
Bounds bounds_of(const Surface &surface);
Bounds bounds_of(std::span<const glm::dvec3> positions); // not empty
double farthest_coordinate(const Bounds &bounds);        // without its sign

// Verifies that the box fits a grid of doubles.
//
// errors  too_large  the box is longer than 1e30 or shorter than 1e-30 (but not zero) model units
Status check_bounds(const Bounds &bounds);

// A cube of 2^depth voxels per edge, centred on the box and wider than it by a factor of 1 + 2^-20, so that no sample
// lies outside. A box without extent gets an edge of 1, or more where doubles are coarser.
Grid centred_grid(const Bounds &bounds, int depth);

// Voxels of exactly this size, their corners at multiples of it; the smallest depth that holds the box.
//
// errors  usage  more than kMaxDepth levels would be needed; voxels finer than doubles are at that place
Result<Grid> snapped_grid(const Bounds &bounds, double voxel_size);

// The grid of a .pbvg file.
//
// errors  io, and those of Reader::open (pbm_format/reading/reader.h)
Result<Grid> read_grid(const std::string &path);

// Depths of the automatic choice. A coarse mesh is sampled more finely than its vertices, so that voxels do not show.
inline constexpr int kMinMeshDepth = 8, kMaxMeshDepth = 12;
inline constexpr int kMinPointDepth = 5, kMaxPointDepth = 14;

// Median length of the triangles' edges (an inner edge counts twice), to 2 %; 0 if every edge has length zero.
double median_edge(const Surface &surface, int threads);

// The depth whose voxel edge is closest to the median edge length, by ratio.
int mesh_depth(const Bounds &bounds, double median_edge);

// [depth 0..kMaxDepth] voxels of the centred grid that the surface's points occupy.
std::vector<std::uint64_t> occupied_voxels(const Surface &surface, const Bounds &bounds, int threads);

// The finest depth at which a level has at least 11/6 times the voxels of the level above. A densely sampled surface
// has 4 times as many. Random points have 1.82 times as many where a voxel's face holds half a point on average, so the
// voxel edge is within a factor of sqrt(2) of the distance between points.
int point_depth(const std::vector<std::uint64_t> &occupied);

// Area of all triangles over the squared edge of the centred grid.
double relative_area(const Surface &surface, const Bounds &bounds, int threads);

// How much the normal changes along a triangle's edge within one voxel, radians: root of the mean square over the area.
// `normals` [positions]; an edge whose ends lack a normal counts as flat.
double normal_change(const Surface &surface, const Bounds &bounds, std::span<const ShortNormal> normals,
                     double voxel_size, int threads);

// A mesh whose normals change by more within a voxel shows finer detail at the next depth. Measured on 16 scans:
// docs/how-to/choose-the-detail.md.
inline constexpr double kMaxNormalChange = 0.0873; // radians: 5 degrees

// How much the colours of vertices change within one voxel, as normal_change has it: of sRGB channels 0..1, summed over
// the three. 0 without such colours.
double colour_change(const Surface &surface, const Bounds &bounds, double voxel_size, int threads);

// Texels of images per square voxel of the triangles that have an image; 0 without any.
double texels_per_voxel(const Surface &surface, const Bounds &bounds, double voxel_size, int threads);

// How much the normals of normal maps change within a voxel, as normal_change has it, over the area that has such maps.
double relief_change(const Surface &surface, std::span<const Relief> reliefs, const Bounds &bounds, double voxel_size,
                     int threads);

// A mesh with more texels of colours per voxel, or whose normal maps change by more than kMaxNormalChange within one,
// gets the next depth, and that again.
inline constexpr double kMaxTexels = 4;
inline constexpr int kMaxDepthsForTexels = 2;

// A mesh gets finer voxels than that where the screen shows them: in a first view of kScreenWidth x kScreenHeight
// pixels none is wider than kMaxScreenVoxel, if the estimated bytes of the model are within those of the scan, or
// within kMinBudget. Fine pictures draw voxels of up to that size.
inline constexpr int kMaxScreenDepth = 11;
inline constexpr double kScreenWidth = 1920, kScreenHeight = 1080, kMaxScreenVoxel = 1.42; // pixels
inline constexpr double kMinBudget = 1.5e6;                                                // bytes

// Largest edge of a voxel in the first view of that size, pixels, without the perspective.
double screen_voxel(const Bounds &bounds, UpAxis up, int depth);

// The bytes of a mesh's file, estimated from its area, normal_change and colour_change (1 if images or faces have the
// colours): of meshes of one colour within 30 %, of coloured or rough ones within a factor of 2. Flat faces weigh less.
double estimated_bytes(double relative_area, double normal_change, double colour_change, int depth);

struct ChosenGrid {
    Grid grid;
    std::string reason; // for the report, where the detail of the surface or of its images decided
};

// The requested grid, with its unit and up axis. By default that of mesh_depth, one depth finer where normal_change
// exceeds kMaxNormalChange, then finer by its images, then by kMaxScreenVoxel. A surface of triangles and points gets
// the finer of the two depths. With max_points the number of voxels is estimated from below: the surface may have more.
// `normals`: as for normal_change.
//
// errors  usage  see snapped_grid; something lies outside of the grid that is taken over, or that is coarser than
//                kMinBuildDepth
Result<ChosenGrid> choose_grid(const Surface &surface, const Bounds &bounds, std::span<const ShortNormal> normals,
                               const GridRequest &request, int threads);

} // namespace pbm::build
