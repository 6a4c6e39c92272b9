#include "pbm_build/grid/up_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace pbm::build {
namespace {

constexpr std::array<UpAxis, 3> kAxes{UpAxis::x, UpAxis::y, UpAxis::z};

using Points = std::vector<glm::dvec3>;

FoundUp found_in(const Points &points, int threads = 1) {
    Surface surface;
    surface.positions = points;
    return find_up_axis(surface, bounds_of(surface), threads);
}

// The z axis becomes `axis`; the other two follow it.
Points turned(const Points &points, std::size_t axis) {
    Points result;
    for (const glm::dvec3 &p : points) {
        glm::dvec3 q;
        for (int i = 0; i < 3; ++i)
            q[(static_cast<int>(axis) + 1 + i) % 3] = p[i];
        result.push_back(q);
    }
    return result;
}

// A cone without a bottom: what a scanner sees of a thing that stands on a table.
Points cone() {
    Points points;
    for (int height = 0; height < 200; ++height)
        for (int i = 0; i < 400; ++i) {
            const double angle = 2 * std::numbers::pi * i / 400, radius = 1 - height / 200.0;
            points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), height / 100.0);
        }
    return points;
}

// A slope with hills: its lowest points are on one side.
Points hillside() {
    Points points;
    for (int x = 0; x < 300; ++x)
        for (int y = 0; y < 300; ++y)
            points.emplace_back(x, y, 0.2 * x + 8 * std::sin(x / 30.0) * std::cos(y / 25.0));
    return points;
}

TEST(UpAxis, IsThatOfTheBase) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const FoundUp found = found_in(turned(cone(), axis));
        EXPECT_EQ(found.up, kAxes[axis]);
        EXPECT_EQ(found.reason, UpReason::base);
        EXPECT_GT(found.share, 0.9);
    }
}

TEST(UpAxis, OfAThingUpsideDownIsItsAxisAllTheSame) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        Points points = turned(cone(), axis);
        for (glm::dvec3 &p : points)
            p = -p;
        const FoundUp found = found_in(points);
        EXPECT_EQ(found.up, kAxes[axis]);
        EXPECT_EQ(found.reason, UpReason::upper_base);
        EXPECT_NE(note_of(found).find("upper end"), std::string::npos);
    }
}

TEST(UpAxis, OfTerrainIsAcrossIt) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const FoundUp found = found_in(turned(hillside(), axis));
        EXPECT_EQ(found.up, kAxes[axis]);
        EXPECT_EQ(found.reason, UpReason::terrain);
    }
}

TEST(UpAxis, IsTheDefaultWhereNothingShowsIt) {
    Points ball, box;
    for (int i = 0; i < 40000; ++i) {
        const double y = 1 - (2 * i + 1) / 40000.0, radius = std::sqrt(1 - y * y), angle = i * 2.399963;
        ball.emplace_back(radius * std::cos(angle), y, radius * std::sin(angle));
    }
    for (int u = 0; u <= 100; ++u)
        for (int v = 0; v <= 100; ++v)
            for (const int end : {0, 100}) {
                box.emplace_back(u, v, end);
                box.emplace_back(u, end, v);
                box.emplace_back(end, u, v);
            }
    for (const Points &points : {ball, box, Points{{1, 2, 3}}, Points{{0, 0, 0}, {0, 0, 5}}, Points(9, {4, 4, 4})}) {
        const FoundUp found = found_in(points);
        EXPECT_EQ(found.up, UpAxis::y);
        EXPECT_EQ(found.reason, UpReason::none);
        EXPECT_NE(note_of(found).find("the default"), std::string::npos);
    }
}

// A thing whose centre does not lie above what touches the ground would fall over.
TEST(UpAxis, ABaseMustCarryItsThing) {
    Points points = cone();
    for (int z = -30; z <= 30; ++z) // a heavy ball beside it
        for (int y = -30; y <= 30; ++y)
            for (int x = -30; x <= 30; ++x)
                if (x * x + y * y + z * z < 900)
                    points.emplace_back(3 + x / 30.0, y / 30.0, 1.2 + z / 30.0);
    EXPECT_EQ(found_in(points).reason, UpReason::none);
}

TEST(UpAxis, OfAMeshOfLargeTriangles) {
    Surface pyramid;
    pyramid.positions = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}, {0, 2, 0}};
    pyramid.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 1, 2}, {0, 2, 3}};
    for (int turns = 0; turns < 3; ++turns) {
        const FoundUp found = find_up_axis(pyramid, bounds_of(pyramid), 2);
        EXPECT_EQ(found.up, kAxes[static_cast<std::size_t>((1 + turns) % 3)]);
        EXPECT_EQ(found.reason, UpReason::base);
        for (glm::dvec3 &p : pyramid.positions)
            p = {p.z, p.x, p.y};
    }
}

TEST(UpAxis, DependsOnNoOrderThreadsOrStrays) {
    Points points = turned(cone(), 0);
    const FoundUp expected = found_in(points);
    std::mt19937 random(7);
    for (const int threads : {1, 2, 5}) {
        std::ranges::shuffle(points, random);
        const FoundUp found = found_in(points, threads);
        EXPECT_EQ(found.up, expected.up);
        EXPECT_EQ(found.share, expected.share);
    }
    for (int i = 0; i < 40; ++i) // fewer than 1/1000
        points.emplace_back(-3 - i % 3, i % 5, 7);
    const FoundUp found = found_in(points);
    EXPECT_EQ(found.up, expected.up);
    EXPECT_EQ(found.reason, UpReason::base);
}

} // namespace
} // namespace pbm::build
