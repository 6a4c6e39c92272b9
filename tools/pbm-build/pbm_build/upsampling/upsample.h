// Fills the gaps between the points of a scan with points on the surface through their neighbours.
// Based on: Alexa, Behr, Cohen-Or, Fleishman, Levin, Silva. Computing and Rendering Point Set Surfaces. 2003 (points on
// the surface of moving least squares fill the largest empty circles)
// Based on: Edelsbrunner, Kirkpatrick, Seidel. On the Shape of a Set of Points in the Plane. 1983 (what is a gap: an
// alpha shape)
#pragma once

#include "pbm_build/surface/vertex_normals.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <vector>

namespace pbm::build {

inline constexpr int kMinGap = 2, kMaxGap = 16; // voxels

struct UpsampleRequest {
    int gap = kMinGap;               // largest gap that is filled, voxels
    std::uint64_t max_bytes = 0;     // of working memory for made points
    std::span<const Field> fields{}; // of the surface, in that order
};

// Appends points to `surface` and `normals`, at most one to each empty voxel of `grid`, and returns the voxels that
// they fill, ascending.
//
// A gap is a place that lies between points: within a triangle of three points of one sheet of the surface whose
// circumcircle is empty, and at most `gap` voxels wide. So a hole stays open as far as a disc of that width fits into
// it, and a border does not grow, except in notches narrower than that. All normals must have been estimated; points
// without one are ignored.
//
// A made point lies on the surface through its neighbours (moving_least_squares.h). Its colour, and its radius and
// fields of means if all three have one, are interpolated between the three points. Its attributes of one byte and
// other fields are those of the nearest one. The result does not depend on the number of threads or the order of the
// points.
//
// errors  memory  more points than max_bytes hold
Result<std::vector<MortonCode>> upsample(Surface &surface, VertexNormals &normals, const Grid &grid,
                                         const UpsampleRequest &request, int threads);

// Removes the points that upsample appended to `given` ones.
void remove_made_points(Surface &surface, VertexNormals &normals, std::size_t given);

} // namespace pbm::build
