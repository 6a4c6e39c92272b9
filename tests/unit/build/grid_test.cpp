#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/lattice/lattice.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace {

using namespace pbm;
using namespace pbm::build;

// A flat rectangle of `columns` x `rows` quads with edges of length 1.
Surface sheet(unsigned columns, unsigned rows) {
    Surface surface;
    for (unsigned y = 0; y <= rows; ++y)
        for (unsigned x = 0; x <= columns; ++x)
            surface.positions.emplace_back(x, y, 0);
    for (unsigned y = 0; y < rows; ++y)
        for (unsigned x = 0; x < columns; ++x) {
            const unsigned a = y * (columns + 1) + x;
            surface.triangles.emplace_back(a, a + 1, a + columns + 2);
            surface.triangles.emplace_back(a, a + columns + 2, a + columns + 1);
        }
    return surface;
}
Surface sheet(unsigned cells) { return sheet(cells, cells); }

TEST(GridChoice, TheMedianEdgeIsWithinTwoPercent) {
    EXPECT_NEAR(median_edge(sheet(50), 2), 1.0, 0.02); // two of three edges
    EXPECT_EQ(median_edge(sheet(50), 1), median_edge(sheet(50), 2));
    Surface nothing;
    nothing.positions.assign(3, {1, 1, 1});
    nothing.triangles = {{0, 1, 2}};
    EXPECT_EQ(median_edge(nothing, 1), 0);
}

TEST(GridChoice, OfTwoMiddleEdgesTheShorterIsTheMedian) {
    Surface surface; // edges of 1, 1, 1, 1.9, 3 and 3
    surface.positions = {{0, 0, 0}, {1, 0, 0},  {0.5, std::sqrt(8.75), 0}, {0.95, std::sqrt(1 - 0.95 * 0.95), 5},
                         {0, 0, 5}, {1.9, 0, 5}};
    surface.triangles = {{0, 1, 2}, {3, 4, 5}};
    EXPECT_NEAR(median_edge(surface, 1), 1, 0.02);
}

TEST(GridChoice, TheVoxelEdgeComesClosestToTheMedianEdge) {
    const Bounds bounds{{0, 0, 0}, {1000, 10, 10}};
    EXPECT_EQ(mesh_depth(bounds, 1.0), 10);          // voxels of 0.98, not 1.95
    EXPECT_EQ(mesh_depth(bounds, 1000.0 / 740), 10); // voxels of 0.98, just closer than 1.95
    EXPECT_EQ(mesh_depth(bounds, 1000.0 / 720), 9);  // 1.95 is closer
    EXPECT_EQ(mesh_depth(bounds, 1000), 8);
    EXPECT_EQ(mesh_depth(bounds, 1e-9), 12);
    EXPECT_EQ(mesh_depth(bounds, 0), 12);
}

TEST(GridChoice, PointsGetTheDepthAtWhichAVoxelHoldsOneOfThem) {
    Surface points = sheet(255);
    points.triangles.clear();
    const auto occupied = occupied_voxels(points, bounds_of(points), 2);
    EXPECT_EQ(occupied[0], 1U);
    EXPECT_EQ(occupied[5], 1024U);
    EXPECT_EQ(occupied[8], 65536U);
    EXPECT_EQ(occupied[16], 65536U);
    EXPECT_EQ(point_depth(occupied), 8);
}

// A depth is too fine if it has less than 11/6 of the voxels of the one above it.
TEST(GridChoice, PointsGetDepthsFrom5To14) {
    std::vector<std::uint64_t> occupied(kMaxDepth + 1, 1);
    EXPECT_EQ(point_depth(occupied), 5);
    for (std::size_t level = 1; level < occupied.size(); ++level)
        occupied[level] = 4 * occupied[level - 1];
    EXPECT_EQ(point_depth(occupied), 14);
    occupied[14] = 11 * occupied[13] / 6 - 1;
    EXPECT_EQ(point_depth(occupied), 13);
    occupied[13] = 6;
    occupied[14] = 11;
    EXPECT_EQ(point_depth(occupied), 14);
}

TEST(GridChoice, TheMarginOfACentredGridIsAMillionthOfItsBox) {
    EXPECT_EQ(centred_grid({{0, 0, 0}, {1, 0.5, 0}}, 8).edge(), 1 + 0x1p-20);
}

TEST(GridChoice, AVoxelSpansAtLeast64Doubles) {
    EXPECT_EQ(centred_grid({{1e20, 0, 0}, {1e20, 0, 0}}, 8).edge(), 1e20 * 0x1p-30);
    const Bounds far{{1e20, 0, 0}, {1e20, 0, 0}};
    EXPECT_TRUE(snapped_grid(far, 1e20 * 0x1p-46));
    EXPECT_FALSE(snapped_grid(far, 1e20 * 0x1.8p-47));
}

TEST(GridChoice, BoxesOfTheLimitsAreAccepted) {
    EXPECT_TRUE(check_bounds({{-1e30, 0, 0}, {1e30, 0, 0}}));
    EXPECT_FALSE(check_bounds({{-1.0001e30, 0, 0}, {0, 0, 0}}));
    EXPECT_TRUE(check_bounds({{0, 0, 0}, {1e-30, 0, 0}}));
    EXPECT_FALSE(check_bounds({{0, 0, 0}, {0.999e-30, 0, 0}}));
}

TEST(GridChoice, ACentredGridHoldsItsBoxAtEveryDepth) {
    const Bounds bounds{{-3, 2, 1e6}, {5, 2.5, 1e6 + 1}};
    for (int depth = kMinDepth; depth <= kMaxDepth; ++depth) {
        const Grid grid = centred_grid(bounds, depth);
        EXPECT_NEAR(grid.edge(), 8, 1e-4);
        for (int axis = 0; axis < 3; ++axis) {
            const double origin = grid.origin[static_cast<std::size_t>(axis)];
            EXPECT_LT(origin, bounds.lowest[axis]);
            EXPECT_GT(origin + grid.edge(), bounds.highest[axis]);
            EXPECT_NEAR(origin + grid.edge() / 2, (bounds.lowest[axis] + bounds.highest[axis]) / 2, 1e-6);
        }
    }
}

TEST(GridChoice, ABoxWithoutExtentGetsAGrid) {
    const Bounds at_origin{{0, 0, 0}, {0, 0, 0}}, far{{1e20, 0, 0}, {1e20, 0, 0}};
    EXPECT_EQ(centred_grid(at_origin, 8).edge(), 1);
    EXPECT_GE(centred_grid(far, 8).edge(), 1e10);
    EXPECT_TRUE(check_bounds(at_origin).ok());
    EXPECT_TRUE(check_bounds(far).ok());
}

TEST(GridChoice, AGivenVoxelSizeSnapsTheOriginToMultiplesOfIt) {
    const Bounds bounds{{500000.13, 4000000.27, 3}, {500090.4, 4000020, 17}};
    const Result<Grid> grid = snapped_grid(bounds, 0.25);
    ASSERT_TRUE(grid.ok());
    EXPECT_EQ(value_of(grid).voxel_size, 0.25);
    EXPECT_EQ(value_of(grid).depth, 9); // 90.27 / 0.25 = 361 voxels
    for (int axis = 0; axis < 3; ++axis) {
        const double origin = value_of(grid).origin[static_cast<std::size_t>(axis)];
        EXPECT_EQ(origin / 0.25, std::floor(origin / 0.25));
        EXPECT_LE(origin, bounds.lowest[axis]);
        EXPECT_GT(origin + value_of(grid).edge(), bounds.highest[axis]);
    }
    EXPECT_EQ(snapped_grid(bounds, 1e-6).error().code, ErrorCode::usage);
    EXPECT_EQ(value_of(snapped_grid(bounds, 1e6)).depth, kMinBuildDepth);
}

// A position at the grid's far side lies in no voxel of a grid that is chosen; in one that is given it is moved by
// nothing.
TEST(GridChoice, TheFarSideOfTheCubeIsOutsideOfASnappedGridAndInsideOfAGivenOne) {
    const Bounds bounds{{0, 0, 0}, {32, 32, 32}};
    EXPECT_EQ(value_of(snapped_grid(bounds, 1)).depth, 6);
    EXPECT_EQ(value_of(snapped_grid({{0, 0, 0}, {30.5, 1, 1}}, 1)).depth, 5);
    Surface corners;
    corners.positions = {{0, 0, 0}, {32, 32, 32}};
    GridRequest request;
    request.like = Grid{.depth = 5, .origin = {0, 0, 0}, .voxel_size = 1};
    EXPECT_TRUE(choose_grid(corners, bounds, {}, request, 1));
    EXPECT_FALSE(choose_grid(corners, {{0, 0, 0}, {32.001, 32, 32}}, {}, request, 1));
}

TEST(GridChoice, AreasAreRoundedToTheNearestUnit) {
    Surface needle; // 0.6 units of 2^-44
    needle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1.2 * 0x1p-44, 0}};
    needle.triangles = {{0, 1, 2}};
    EXPECT_EQ(relative_area(needle, bounds_of(needle), 1), 0x1p-44);
}

TEST(GridChoice, AreaIsRelativeToTheEdge) {
    const Surface surface = sheet(10);
    EXPECT_NEAR(relative_area(surface, bounds_of(surface), 2), 1.0, 1e-5);
}

TEST(GridChoice, AreasBeyondAMillionTimesTheBoxAreSummed) {
    Surface soup; // the same triangle, half a face of the box, three million times
    soup.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    soup.triangles.assign(3000000, {0, 1, 2});
    EXPECT_NEAR(relative_area(soup, bounds_of(soup), 2), 1.5e6, 10);
}

// A sheet rolled up to a cylinder of this radius, with its normals.
Surface rolled(unsigned columns, unsigned rows, double radius, std::vector<ShortNormal> &normals) {
    Surface surface = sheet(columns, rows);
    normals.clear();
    for (glm::dvec3 &p : surface.positions) {
        const double angle = p.x / radius;
        p = {radius * std::sin(angle), p.y, radius * std::cos(angle)};
        normals.push_back(to_short_normal({std::sin(angle), 0, std::cos(angle)}));
    }
    return surface;
}

TEST(GridChoice, NormalsChangeWithinAVoxelAsTheSurfaceIsCurved) {
    std::vector<ShortNormal> normals;
    const Surface surface = rolled(200, 200, 50, normals);
    const Bounds bounds = bounds_of(surface);
    // Of a triangle's edges of length 1, 1 and sqrt(2), the first turns by 1/50, the second not, the third by 1/50.
    const double within_an_edge = std::sqrt((1 + 0.5) / 3);
    EXPECT_NEAR(normal_change(surface, bounds, normals, 0.5, 2), within_an_edge * 0.5 / 50, 2e-4);
    EXPECT_NEAR(normal_change(surface, bounds, normals, 4, 2), std::sqrt(2.0 / 3) / 50, 2e-4); // no detail beyond edges
    EXPECT_EQ(normal_change(surface, bounds, normals, 0.5, 1), normal_change(surface, bounds, normals, 0.5, 2));
    const std::vector<ShortNormal> missing(normals.size());
    EXPECT_EQ(normal_change(surface, bounds, missing, 0.5, 2), 0);
}

TEST(GridChoice, DetailGetsOneDepthMore) {
    const auto depth_of = [](const Surface &surface, const std::vector<ShortNormal> &normals) {
        return value_of(choose_grid(surface, bounds_of(surface), normals, {}, 2)).grid.depth;
    };
    std::vector<ShortNormal> normals;
    const Surface gentle = rolled(100, 1200, 400, normals);
    EXPECT_EQ(depth_of(gentle, normals), mesh_depth(bounds_of(gentle), median_edge(gentle, 2)));
    const Surface tight = rolled(100, 1200, 5, normals);
    EXPECT_EQ(depth_of(tight, normals), mesh_depth(bounds_of(tight), median_edge(tight, 2)) + 1);
}

TEST(GridChoice, FiveDegreesWithinAVoxelAreDetail) {
    std::size_t finer = 0, asked = 0;
    for (const double radius : {6.5, 7.0, 7.5, 8.0, 8.4, 8.8, 9.5}) {
        std::vector<ShortNormal> normals;
        const Surface surface = rolled(100, 1200, radius, normals);
        const Bounds bounds = bounds_of(surface);
        const int depth = mesh_depth(bounds, median_edge(surface, 2));
        const double change = normal_change(surface, bounds, normals, centred_grid(bounds, depth).voxel_size, 2);
        const int chosen = value_of(choose_grid(surface, bounds, normals, {}, 2)).grid.depth;
        EXPECT_EQ(chosen, change > 0.0873 ? depth + 1 : depth) << radius << ": " << change;
        finer += chosen > depth ? 1 : 0;
        ++asked;
    }
    EXPECT_GT(finer, 2U);
    EXPECT_LT(finer, asked);
}

TEST(GridChoice, AMeshGetsVoxelsOfAPixelOfTheFirstView) {
    const auto depth_of = [](const Surface &surface, std::uint64_t scan_bytes = 0) {
        GridRequest request;
        request.scan_bytes = scan_bytes;
        const std::vector<ShortNormal> normals(surface.positions.size(), to_short_normal({0, 0, 1}));
        const int depth = value_of(choose_grid(surface, bounds_of(surface), normals, request, 1)).grid.depth;
        EXPECT_EQ(value_of(choose_grid(surface, bounds_of(surface), normals, request, 2)).grid.depth, depth);
        return depth;
    };
    const Surface high = sheet(20); // as high as 0.95 of 1080 pixels
    EXPECT_NEAR(screen_voxel(bounds_of(high), UpAxis::y, 10), 0.95 * 1080 / 1024, 1e-3);
    EXPECT_EQ(depth_of(high), 10);
    const Surface wide = sheet(200, 20); // as wide as 0.95 of 1920 pixels
    EXPECT_NEAR(screen_voxel(bounds_of(wide), UpAxis::y, 10), 0.95 * 1920 / 1024, 1e-3);
    EXPECT_EQ(depth_of(wide), 11);

    Surface line = sheet(1);
    for (glm::dvec3 &p : line.positions)
        p.y = p.x;
    EXPECT_EQ(depth_of(line), kMinMeshDepth);

    Surface stack; // of 40 sheets: its model would be larger than any of 1.5 MB
    for (int i = 0; i < 40; ++i) {
        const Surface one = sheet(20);
        const auto first = static_cast<unsigned>(stack.positions.size());
        for (const glm::dvec3 &p : one.positions)
            stack.positions.push_back(p + glm::dvec3(0, 0, 0.25 * i));
        for (const glm::uvec3 &t : one.triangles)
            stack.triangles.push_back(t + first);
    }
    const double bytes = estimated_bytes(relative_area(stack, bounds_of(stack), 1), 0, 0, 10);
    EXPECT_GT(bytes, kMinBudget);
    EXPECT_LT(depth_of(stack), 10);
    EXPECT_LT(depth_of(stack, static_cast<std::uint64_t>(bytes) - 1), 10);
    EXPECT_EQ(depth_of(stack, static_cast<std::uint64_t>(bytes) + 1), 10);
}

TEST(GridChoice, ColoursCountAsMuchAsTheyChange) {
    Surface surface = sheet(20);
    const Bounds bounds = bounds_of(surface);
    const std::vector<ShortNormal> normals(surface.positions.size(), to_short_normal({0, 0, 1}));
    const auto depth_of = [&](std::uint64_t scan_bytes) {
        GridRequest request;
        request.scan_bytes = scan_bytes;
        return value_of(choose_grid(surface, bounds, normals, request, 2)).grid.depth;
    };
    EXPECT_EQ(colour_change(surface, bounds, 0.5, 2), 0);
    const int plain = depth_of(0);
    surface.colours.assign(surface.positions.size(), Rgb8{200, 40, 40});
    EXPECT_EQ(colour_change(surface, bounds, 0.5, 2), 0);
    EXPECT_EQ(depth_of(0), plain); // one colour takes no bytes

    for (std::size_t i = 0; i < surface.colours.size(); ++i)
        if (surface.positions[i].x > 9.5)
            surface.colours[i] = {200, 40, 91}; // 0.2 of a channel more, along 1 of 20 columns
    const double change = colour_change(surface, bounds, 0.5, 2);
    EXPECT_GT(change, 0.2 * 0.5 * std::sqrt(1.0 / 20 / 3));
    EXPECT_LT(change, 0.2 * 0.5 * std::sqrt(1.0 / 20));
    EXPECT_EQ(change, colour_change(surface, bounds, 0.5, 1));
    EXPECT_NEAR(colour_change(surface, bounds, 0.25, 2), change / 2, 1e-6);

    for (std::size_t i = 0; i < surface.colours.size(); ++i)
        surface.colours[i] = i % 2 == 0 ? Rgb8{0, 0, 0} : Rgb8{255, 255, 255};
    const double area = relative_area(surface, bounds, 2), edge = centred_grid(bounds, plain).voxel_size;
    const double bytes = estimated_bytes(area, 0, colour_change(surface, bounds, edge, 2), plain);
    EXPECT_GT(bytes, 2 * estimated_bytes(area, 0, 0, plain));
    EXPECT_LE(bytes, 11.1 * estimated_bytes(area, 0, 0, plain)); // at most a byte for each voxel
}

TEST(GridChoice, PointsAtRandomGetAVoxelEdgeWithinSqrtTwoOfTheirDistance) {
    Surface points;
    std::mt19937 bits(5);
    const auto random = [&] { return static_cast<double>(bits()) * 0x1p-32; };
    for (int i = 0; i < 100000; ++i)
        points.positions.emplace_back(random(), random(), 0);
    const double distance = std::sqrt(1e-5);
    const double voxel = std::ldexp(1, -point_depth(occupied_voxels(points, bounds_of(points), 2)));
    EXPECT_GT(voxel, distance / 1.45);
    EXPECT_LT(voxel, distance * 1.45);
}

TEST(Lattice, CoordinatesAreRoundedAndStayInside) {
    Grid grid;
    grid.depth = 4;
    grid.origin = {10, 20, 30};
    grid.voxel_size = 0.5;
    const std::vector<glm::dvec3> places{{10, 20, 30}, {10.5 - 1e-12, 21, 38}, {-100, 1e30, 34}};
    const auto lattice = to_lattice(places, grid, 2);
    EXPECT_EQ(lattice[0], LatticePoint(0, 0, 0));
    EXPECT_EQ(lattice[1], LatticePoint(1 << kLatticeBits, 2 << kLatticeBits, (16 << kLatticeBits) - 1));
    EXPECT_EQ(voxel_of(lattice[2]), glm::ivec3(0, 15, 8));
}

} // namespace
