// Interpolates the attributes of a triangle's corners at its points nearest to the centres of voxels, several voxels at
// once.
// Based on: Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (closest point on a triangle)
#pragma once

#include "pbm_build/surface/short_normal.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm::build {

// A voxel of a block of 32x32x32: x | y << 8 | z << 16.
using PlaceInBlock = std::int32_t;

// Samples in columns, a row each.
struct MixedRows {
    static constexpr std::size_t kRows = NormalColumns::kRows;
    template <class T> using Column = std::array<T, kRows + NormalColumns::kSpare>;

    Column<PlaceInBlock> places{}; // voxels of the samples
    NormalColumns normals;
    std::array<Column<std::int32_t>, 3> colours{}; // linear light; not written if there are none
    std::array<Column<double>, 3> weights{};       // of the corners
};

struct TriangleMix {
    using Three = std::array<double, 3>; // x y z, or one of each corner

    // Corners in voxel units, on the lattice (lattice.h).
    void set_corners(const std::array<glm::dvec3, 3> &at);

    // Computes the samples of rows `first` to `end`, in voxels of the block whose first voxel has its centre at
    // `block_centre`. Also overwrites rows from `end` on. The same bits on every processor: a fixed order of
    // operations, none fused.
    void mix(const glm::dvec3 &block_centre, std::size_t first, std::size_t end, MixedRows &rows) const;

    std::array<Three, 3> normals{}, colours{}; // [axis or channel][corner]; of any length, linear light
    bool has_colour = false;
    Three flat{};              // a ShortNormal
    bool is_flat = false;      // all samples have the normal `flat`
    bool in_one_voxel = false; // all samples are taken at the centroid

    std::array<glm::dvec3, 3> corners{};
    glm::dvec3 ab{}, ac{};
    double ab_ab = 0, ab_ac = 0, ac_ac = 0;
    bool exact = true; // products of ab and ac with differences of lattice points are exact
};

} // namespace pbm::build
