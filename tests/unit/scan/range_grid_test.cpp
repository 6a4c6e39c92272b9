#include "pbm_scan/surface/range_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace {

using pbm::build::kEmptyCell;
using pbm::build::triangulate_range_grid;
using Triangles = std::vector<glm::uvec3>;

// A plane seen from the front: `width` x `height` vertices, 1 apart.
struct Grid {
    std::vector<glm::dvec3> positions;
    std::vector<std::uint32_t> cells;
    std::size_t columns;
};

Grid plane(std::size_t width, std::size_t height, double row_step = 1.0) {
    Grid grid{.positions = {}, .cells = {}, .columns = width};
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            grid.cells.push_back(static_cast<std::uint32_t>(grid.positions.size()));
            grid.positions.emplace_back(static_cast<double>(x) * row_step, static_cast<double>(y), 0);
        }
    return grid;
}

Triangles triangles(const Grid &grid) { return triangulate_range_grid(grid.cells, grid.columns, grid.positions); }

TEST(RangeGrid, APlaneIsCoveredAndFacesTheScanner) {
    const Grid grid = plane(4, 3);
    const Triangles found = triangles(grid);
    EXPECT_EQ(found.size(), 2U * 3U * 2U);
    for (const glm::uvec3 t : found) {
        const glm::dvec3 u = grid.positions[t.y] - grid.positions[t.x], v = grid.positions[t.z] - grid.positions[t.x];
        EXPECT_DOUBLE_EQ(u.x * v.y - u.y * v.x, 1.0);
    }
}

TEST(RangeGrid, AStepInDepthStaysOpen) {
    Grid grid = plane(6, 6);
    for (glm::dvec3 &p : grid.positions)
        p.z = p.x >= 3 ? -5.0 : 0.0;
    EXPECT_EQ(triangles(grid).size(), 2U * (5U * 5U - 5U));
    for (glm::dvec3 &p : grid.positions)
        p.z *= 0.6; // an edge 3.2 steps long still counts as a slope
    EXPECT_EQ(triangles(grid).size(), 2U * 5U * 5U);
}

TEST(RangeGrid, StepsOfRowsAndColumnsAreMeasuredApart) {
    Grid grid = plane(8, 8, 0.1); // five steps within a row are shorter than one within a column
    for (std::size_t row = 0; row < 8; ++row)
        for (std::size_t column = 4; column < 8; ++column)
            grid.positions[8 * row + column].x += 0.5;
    EXPECT_EQ(triangles(grid).size(), 2U * 7U * 6U);
}

TEST(RangeGrid, AnEmptyCellLeavesTheTriangleOfTheOtherThree) {
    Grid grid = plane(2, 2);
    for (std::size_t empty = 0; empty < 4; ++empty) {
        Grid three = grid;
        three.cells[empty] = kEmptyCell;
        ASSERT_EQ(triangles(three).size(), 1U) << empty;
        const glm::uvec3 t = triangles(three)[0];
        EXPECT_TRUE(t.x != empty && t.y != empty && t.z != empty);
        three.cells[3 - empty] = kEmptyCell;
        EXPECT_TRUE(triangles(three).empty());
    }
    grid.positions[2].y = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(triangles(grid).size(), 1U);
}

TEST(RangeGrid, AVertexInTwoCellsMakesNoDegenerateTriangle) {
    Grid grid = plane(2, 2);
    grid.cells[1] = 0;
    ASSERT_EQ(triangles(grid).size(), 1U);
    EXPECT_EQ(triangles(grid)[0], glm::uvec3(0, 3, 2));
}

TEST(RangeGrid, QuadsAreCutAlongTheShorterDiagonal) {
    Grid grid = plane(2, 2);
    grid.positions[0].z = -1; // 0-3 is longer than 1-2
    const Triangles found = triangles(grid);
    ASSERT_EQ(found.size(), 2U);
    for (const glm::uvec3 t : found)
        EXPECT_EQ((t.x == 1) + (t.y == 1) + (t.z == 1) + (t.x == 2) + (t.y == 2) + (t.z == 2), 2);
}

TEST(RangeGrid, RowsDoNotWrapAround) {
    Grid grid = plane(3, 2);
    for (glm::dvec3 &p : grid.positions)
        p = glm::dvec3(p.x * 1e-3, p.y * 1e-3, 0); // all vertices are close to each other
    EXPECT_EQ(triangles(grid).size(), 4U);
    EXPECT_TRUE(triangles(plane(5, 1)).empty());
    EXPECT_TRUE(triangles(plane(1, 5)).empty());
}

// A floor seen from 2 above it: the steps on it grow with the distance from the scanner.
TEST(RangeGrid, StepsGrowWithTheDistanceFromTheScanner) {
    const glm::dvec3 scanner(0, 0, 2);
    Grid grid{.positions = {}, .cells = {}, .columns = 40};
    for (int row = 0; row < 40; ++row)
        for (int column = 0; column < 40; ++column) {
            const double down = 0.35 + 0.025 * row, aside = 0.025 * column; // radians
            const double distance = 2 / std::tan(down);
            grid.cells.push_back(static_cast<std::uint32_t>(grid.positions.size()));
            grid.positions.emplace_back(distance * std::cos(aside), distance * std::sin(aside), 0);
        }
    EXPECT_EQ(triangulate_range_grid(grid.cells, grid.columns, grid.positions, &scanner).size(), 2U * 39U * 39U);
    EXPECT_LT(triangles(grid).size(), 2U * 39U * 39U);
}

} // namespace
