// Planes through the neighbours of several points at once.
#pragma once

#include "pbm_build/lattice/lattice.h"
#include "pbm_build/surface/short_normal.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm::build {

inline constexpr std::size_t kMinNeighbours = 10, kMaxNeighbours = 30; // that a plane is fitted to
inline constexpr std::size_t kLinks = 8;                               // nearest neighbours that are kept

// A point in each row. All have the same number of neighbours. The same bits on every processor: a fixed order of
// operations, none fused.
struct PlaneColumns {
    static constexpr std::size_t kRows = 16;
    template <class T> using Column = std::array<T, kRows>;
    template <class T> using Vectors = std::array<Column<T>, 3>; // [axis]

    alignas(64) std::array<Vectors<std::int32_t>, kMaxNeighbours> offsets{}; // in lattice steps, nearest first

    // The least-squares plane through the point and its nearest `count` neighbours, weighted by distance.
    struct Planes {
        alignas(64) Vectors<double> normals;  // zero where the points lie on a line
        alignas(64) Vectors<double> along;    // in the plane; zero with the normal
        alignas(64) Column<double> roughness; // least moment to middle one, 0..1
        alignas(64) Column<double> breadth;   // middle moment to largest one, 0..1
    };
    void fit(std::size_t count, Planes &planes) const;

    // Whether the directions of the nearest `count` neighbours, at most kMinNeighbours, leave a gap of 150 degrees in
    // the plane: some direction then has no other one within 150 degrees to its left.
    void find_borders(std::size_t count, const Planes &planes, Column<std::uint8_t> &at_border) const;

    // Mean distance to the nearest `count` neighbours, in lattice steps; 0 if there are none.
    void measure(std::size_t count, Column<float> &spacing) const;
};

} // namespace pbm::build
