#include "pbm_scan/surface/polygon.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace {

using pbm::build::PolygonTriangulator;
using Points = std::vector<glm::dvec3>;
using Triangles = std::vector<glm::uvec3>;

std::vector<std::uint32_t> all_of(const Points &points) {
    std::vector<std::uint32_t> corners;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        corners.push_back(i);
    return corners;
}

Triangles triangulated(const Points &points, const std::vector<std::uint32_t> &corners, std::size_t flat = 0) {
    Triangles triangles;
    EXPECT_EQ(PolygonTriangulator().triangulate(corners, points, triangles), flat);
    return triangles;
}

glm::dvec3 area(const Points &points, const std::vector<std::uint32_t> &corners) {
    glm::dvec3 sum(0.0);
    for (std::size_t i = 2; i < corners.size(); ++i)
        sum += glm::cross(points[corners[i - 1]] - points[corners[0]], points[corners[i]] - points[corners[0]]);
    return sum;
}

// If no triangle is inverted and the areas add up to the polygon's, the triangles cover the polygon exactly once.
void expect_exact_cover(const Points &points, const std::vector<std::uint32_t> &corners, const Triangles &triangles) {
    const glm::dvec3 whole = area(points, corners);
    const double size = glm::length(whole);
    double sum = 0;
    for (const glm::uvec3 t : triangles) {
        const double part = glm::dot(glm::cross(points[t.y] - points[t.x], points[t.z] - points[t.x]), whole / size);
        EXPECT_GE(part, -1e-9 * size);
        sum += part;
    }
    EXPECT_NEAR(sum, size, 1e-9 * size);
    EXPECT_EQ(triangles.size(), corners.size() - 2);
}

// Maps the point to a tilted plane, so that no coordinate is zero.
glm::dvec3 tilted(double x, double y) {
    const glm::dvec3 u(0.48, 0.6, -0.64), v(-0.8, 0.6, 0.0);
    return glm::dvec3(7, -3, 11) + x * u + y * v;
}

TEST(Polygon, ConvexOnesAreFannedFromTheirFirstCorner) {
    const Points points = {{0, 0, 0}, {2, 0, 0}, {3, 2, 0}, {1, 4, 0}, {-1, 2, 0}};
    EXPECT_EQ(triangulated(points, {0, 1, 2, 3}), (Triangles{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(triangulated(points, {0, 1, 2, 3, 4}), (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
    EXPECT_EQ(triangulated(points, {4, 3, 2, 1, 0}), (Triangles{{4, 3, 2}, {4, 2, 1}, {4, 1, 0}}));
}

TEST(Polygon, AConcaveQuadIsCutAtItsNotchWhereverItBegins) {
    const Points arrow = {{0, 0, 0}, {2, 2, 0}, {0, 1, 0}, {-2, 2, 0}}; // the notch is corner 2
    for (std::uint32_t first = 0; first < 4; ++first) {
        std::vector<std::uint32_t> corners;
        for (std::uint32_t i = 0; i < 4; ++i)
            corners.push_back((first + i) % 4);
        expect_exact_cover(arrow, corners, triangulated(arrow, corners));
        std::reverse(corners.begin(), corners.end());
        expect_exact_cover(arrow, corners, triangulated(arrow, corners));
    }
}

TEST(Polygon, NotchesAreNotCovered) {
    Points comb; // teeth along the upper edge
    for (int tooth = 0; tooth < 6; ++tooth) {
        comb.push_back(tilted(2 * tooth, 0));
        comb.push_back(tilted(2 * tooth + 1, 0));
    }
    for (int tooth = 5; tooth >= 0; --tooth) {
        comb.push_back(tilted(2 * tooth + 1, 5));
        comb.push_back(tilted(2 * tooth + 0.5, 1));
    }
    for (std::uint32_t first = 0; first < comb.size(); ++first) {
        std::vector<std::uint32_t> corners;
        for (std::uint32_t i = 0; i < comb.size(); ++i)
            corners.push_back((first + i) % static_cast<std::uint32_t>(comb.size()));
        expect_exact_cover(comb, corners, triangulated(comb, corners));
    }
}

TEST(Polygon, RandomOutlinesAreCoveredExactly) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> radius(0.2, 3.0);
    for (int round = 0; round < 300; ++round) {
        const std::size_t count = 5 + random() % 60;
        Points points;
        for (std::size_t i = 0; i < count; ++i) {
            const double angle = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(count);
            const double r = radius(random);
            points.push_back(tilted(r * std::cos(angle), r * std::sin(angle)));
        }
        expect_exact_cover(points, all_of(points), triangulated(points, all_of(points)));
    }
}

TEST(Polygon, ASpiralIsCoveredExactly) {
    Points points;
    for (int i = 0; i <= 100; ++i)
        points.push_back(tilted((1 + 0.1 * i) * std::cos(0.2 * i), (1 + 0.1 * i) * std::sin(0.2 * i)));
    for (int i = 100; i >= 0; --i)
        points.push_back(tilted((0.6 + 0.1 * i) * std::cos(0.2 * i), (0.6 + 0.1 * i) * std::sin(0.2 * i)));
    expect_exact_cover(points, all_of(points), triangulated(points, all_of(points)));
}

TEST(Polygon, AHoleReachedByASlitStaysOpen) {
    // A square of 4 x 4 with a hole of 2 x 2; the outline visits corners 0 and 4 twice.
    const Points points = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}};
    const std::vector<std::uint32_t> corners = {0, 1, 2, 3, 0, 4, 5, 6, 7, 4};
    const Triangles triangles = triangulated(points, corners);
    expect_exact_cover(points, corners, triangles);
    EXPECT_DOUBLE_EQ(glm::length(area(points, corners)), 2 * 12.0);
}

TEST(Polygon, CornersInALineKeepTheirPlace) {
    const Points points = {tilted(0, 0), tilted(1, 0), tilted(2, 0), tilted(3, 0), tilted(3, 3),
                           tilted(2, 3), tilted(2, 1), tilted(1, 1), tilted(1, 3), tilted(0, 3)};
    expect_exact_cover(points, all_of(points), triangulated(points, all_of(points)));
}

TEST(Polygon, RepeatedCornersAreCountedAndLeftOut) {
    const Points points = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    EXPECT_EQ(triangulated(points, {0, 1, 1, 2}, 1), (Triangles{{0, 1, 2}}));
    EXPECT_EQ(triangulated(points, {0, 1, 2, 0}, 1), (Triangles{{0, 1, 2}}));
    EXPECT_EQ(triangulated(points, {0, 1, 0, 1}, 2), Triangles());
    EXPECT_EQ(triangulated(points, {1, 1, 1, 1, 1}, 3), Triangles());
    EXPECT_EQ(triangulated(points, {0, 1}, 1), Triangles());
    EXPECT_EQ(triangulated(points, {}, 1), Triangles());
}

TEST(Polygon, AnOutlineThatGoesRoundTwiceCountsOnce) {
    const Points points = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    EXPECT_EQ(triangulated(points, {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3}, 8), (Triangles{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(triangulated(points, {0, 1, 2, 0, 1, 2}, 3), (Triangles{{0, 1, 2}}));
}

TEST(Polygon, WithoutAreaOrWithACrossingOutlineItIsStillBounded) {
    Points points;
    for (int i = 0; i < 9; ++i)
        points.emplace_back(i, 0, 0);
    EXPECT_EQ(triangulated(points, all_of(points)).size(), 7U); // all corners are collinear
    EXPECT_EQ(triangulated(Points(9, glm::dvec3(1.0)), all_of(points)).size(), 7U);
    Points star; // crosses itself
    for (int i = 0; i < 7; ++i)
        star.emplace_back(std::cos(i * 2.69), std::sin(i * 2.69), 0);
    EXPECT_EQ(triangulated(star, all_of(star)).size(), 5U);
    std::mt19937 random(3);
    Points noise;
    for (std::size_t i = 0; i < pbm::build::kMaxFannedCorners; ++i)
        noise.emplace_back(random() % 1000, random() % 1000, random() % 1000);
    EXPECT_EQ(triangulated(noise, all_of(noise)).size(), noise.size() - 2);
    for (glm::dvec3 &p : noise)
        p *= 1e300; // areas overflow
    EXPECT_EQ(triangulated(noise, all_of(noise)).size(), noise.size() - 2);
}

TEST(Polygon, OutlinesOfManyCornersAreCoveredExactly) {
    Points zig_zag, spiral, circle;
    constexpr int kTeeth = 50000;
    for (int i = 0; i < kTeeth; ++i)
        zig_zag.push_back(tilted(i, i % 2));
    for (int i = kTeeth; i-- > 0;)
        zig_zag.push_back(tilted(i, i % 2 + 0.5));
    constexpr int kTurns = 5000;
    for (int i = 0; i <= kTurns; ++i)
        spiral.push_back(tilted((1 + 0.01 * i) * std::cos(0.2 * i), (1 + 0.01 * i) * std::sin(0.2 * i)));
    for (int i = kTurns; i >= 0; --i)
        spiral.push_back(tilted((0.9 + 0.01 * i) * std::cos(0.2 * i), (0.9 + 0.01 * i) * std::sin(0.2 * i)));
    for (int i = 0; i < kTurns; ++i)
        circle.push_back(tilted(std::cos(6.283185307179586 * i / kTurns), std::sin(6.283185307179586 * i / kTurns)));
    for (const Points &points : {zig_zag, spiral, circle})
        expect_exact_cover(points, all_of(points), triangulated(points, all_of(points)));
    const auto length = [&](const glm::uvec3 &t) { return glm::distance(circle[t.x], circle[t.z]); };
    double sum = 0;
    for (const glm::uvec3 &t : triangulated(circle, all_of(circle)))
        sum += length(t);
    EXPECT_LT(sum, 100) << "a fan has a sum of 2 x 5,000 radii";
}

TEST(Polygon, ALargeOneThatCrossesItselfIsCutOffAndCounted) {
    std::mt19937 random(4);
    Points noise;
    for (std::size_t i = 0; i < 4 * pbm::build::kMaxFannedCorners; ++i)
        noise.emplace_back(random() % 1000, random() % 1000, 0);
    Triangles triangles;
    const std::size_t omitted = PolygonTriangulator().triangulate(all_of(noise), noise, triangles);
    EXPECT_GT(omitted, 0U);
    EXPECT_EQ(triangles.size() + omitted, noise.size() - 2);
    const Points line(4 * pbm::build::kMaxFannedCorners, glm::dvec3(1.0));
    EXPECT_TRUE(triangulated(line, all_of(line), line.size() - 2).empty());
}

TEST(Polygon, OneCornerThatIsNotFiniteTakesTheWholePolygonAlong) {
    Points points = {{0, 0, 0}, {2, 0, 0}, {3, 2, 0}, {1, 4, 0}, {-1, 2, 0}};
    for (std::uint32_t bad = 0; bad < 5; ++bad) {
        Points broken = points;
        broken[bad].y = std::numeric_limits<double>::quiet_NaN();
        for (const glm::uvec3 t : triangulated(broken, all_of(points)))
            EXPECT_TRUE(t.x == bad || t.y == bad || t.z == bad);
    }
}

} // namespace
