// Range images: what a scanner measured along a grid of lines of sight, one vertex or none per cell, as triangles.
// Based on: Turk, Levoy. Zippered polygon meshes from range images. 1994 (section 3)
#pragma once

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace pbm::build {

constexpr std::uint32_t kEmptyCell = std::numeric_limits<std::uint32_t>::max();

// The longest edge of a triangle, in grid steps: what is longer bridges a step in depth, from the object to what lies
// behind it. Turk and Levoy's figure; a surface is kept up to about 75 degrees from facing the scanner.
constexpr double kLongestGridEdge = 4.0;

// Triangles between neighbouring cells: four vertices are cut along the shorter diagonal, three make one triangle. An
// edge may be at most kLongestGridEdge steps long; a step along a row or a column is the median distance of
// neighbours there, a diagonal step is the hypotenuse of the two. Wound as in Stanford's files: counter-clockwise with
// columns to the right and rows upwards, which is how the scanner saw them. Vertices that are not finite count as
// empty.
//
// `cells` runs row by row, `cells.size()` is a multiple of `columns`; entries are indices of `positions` or kEmptyCell.
std::vector<glm::uvec3> triangulate_range_grid(std::span<const std::uint32_t> cells, std::size_t columns,
                                               std::span<const glm::dvec3> positions);

} // namespace pbm::build
