// Triangulates range images: a grid of lines of sight with one vertex or none per cell.
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

// Maximum edge of a triangle in grid steps: a longer edge spans a depth discontinuity. Turk and Levoy's figure; keeps
// surfaces up to about 75 degrees from facing the scanner.
constexpr double kLongestGridEdge = 4.0;

// Triangles between neighbouring cells: four vertices are split along the shorter diagonal, three make one triangle.
// Edges are at most kLongestGridEdge steps; a step along a row or column is the median distance of neighbours there, a
// diagonal step the hypotenuse of the two. Wound as in Stanford's files: counter-clockwise as seen by the scanner, with
// columns to the right and rows upwards. Non-finite vertices count as empty.
//
// With `scanner`, in the coordinates of the positions, the steps are angles: a distance is divided by that of its
// nearer end from the scanner. A laser scanner turns by equal angles, so that its steps grow with the distance.
//
// `cells` runs row by row, `cells.size()` is a multiple of `columns`; entries are indices of `positions` or kEmptyCell.
std::vector<glm::uvec3> triangulate_range_grid(std::span<const std::uint32_t> cells, std::size_t columns,
                                               std::span<const glm::dvec3> positions,
                                               const glm::dvec3 *scanner = nullptr);

} // namespace pbm::build
