// Estimated normals against the truth. normals_of_scans.cpp does the same for scans.
#include "pbm-sample/ammonite/ammonite.h"
#include "pbm_scan/surface_reader.h"
#include "unit/build/normal_truth.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string_view>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

const double kPi = std::acos(-1.0);

// Uniform in [0, 1).
struct Random {
    std::mt19937 bits{7};
    double operator()() { return static_cast<double>(bits()) * 0x1p-32; }
    double normal() { return std::sqrt(-2 * std::log(1 - (*this)())) * std::cos(2 * kPi * (*this)()); }
};

Truth sphere(std::size_t count, double noise = 0) {
    Truth truth;
    Random random;
    for (std::size_t i = 0; i < count; ++i) {
        const double z = 2 * random() - 1, around = 2 * kPi * random(), r = std::sqrt(1 - z * z);
        const glm::dvec3 n(r * std::cos(around), r * std::sin(around), z);
        truth.add((1 + noise * random.normal()) * n, n);
    }
    return truth;
}

Truth torus(std::size_t count) {
    Truth truth;
    Random random;
    while (truth.normals.size() < count) {
        const double around = 2 * kPi * random(), tube = 2 * kPi * random();
        if (random() > (1 + 0.3 * std::cos(tube)) / 1.3)
            continue;
        const glm::dvec3 out(std::cos(around), std::sin(around), 0);
        const glm::dvec3 n = std::cos(tube) * out + glm::dvec3(0, 0, std::sin(tube));
        truth.add(out + 0.3 * n, n);
    }
    return truth;
}

// Random points on the sides of a box around the origin.
Truth box(std::size_t count, const glm::dvec3 &half) {
    Truth truth;
    Random random;
    const glm::dvec3 areas(half.y * half.z, half.z * half.x, half.x * half.y);
    for (std::size_t i = 0; i < count; ++i) {
        const double pick = random() * (areas.x + areas.y + areas.z);
        const int axis = pick < areas.x ? 0 : pick < areas.x + areas.y ? 1 : 2;
        glm::dvec3 p(2 * random() - 1, 2 * random() - 1, 2 * random() - 1), n(0);
        n[axis] = p[axis] < 0 ? -1 : 1;
        p[axis] = n[axis];
        truth.add(p * half, n);
    }
    return truth;
}

Truth two_spheres(std::size_t count) {
    Truth truth = sphere(count);
    const Truth other = sphere(count);
    for (std::size_t i = 0; i < count; ++i)
        truth.add(0.7 * other.points.positions[i] * glm::dvec3(-1, 1, 1), -other.normals[i] * glm::dvec3(-1, 1, 1));
    return truth; // a hollow ball: the inner wall faces inwards
}

// A height field, Y up.
Truth terrain(std::size_t count, double height) {
    Truth truth;
    Random random;
    for (std::size_t i = 0; i < count; ++i) {
        const double x = 10 * random(), z = 10 * random();
        truth.add(
            {x, height * std::sin(x) * std::cos(z), z},
            glm::dvec3(-height * std::cos(x) * std::cos(z), 1, height * std::sin(x) * std::sin(z)) /
                std::sqrt(1 + height * height *
                                  (std::pow(std::cos(x) * std::cos(z), 2) + std::pow(std::sin(x) * std::sin(z), 2))));
    }
    return truth;
}

Score score(const Truth &truth, const PointRequest &request = {}) {
    return score(::testing::UnitTest::GetInstance()->current_test_info()->name(), truth, request);
}

TEST(EstimateNormals, ASphere) {
    const Score s = score(sphere(20000));
    EXPECT_LT(s.worst, 10);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_EQ(s.two_sided, 0);
}

TEST(EstimateNormals, ANoisySphere) {
    const Score s = score(sphere(20000, 0.01)); // noise: 0.4 of the distance between points
    EXPECT_LT(s.bent, 0.01);
    EXPECT_LT(s.wrong, 0.001);
    EXPECT_LT(s.two_sided, 0.005);
}

TEST(EstimateNormals, ATorus) {
    const Score s = score(torus(20000));
    EXPECT_EQ(s.bent, 0);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_EQ(s.two_sided, 0);
}

TEST(EstimateNormals, ACubeWithSharpEdges) {
    const Score s = score(box(20000, {1, 1, 1}));
    EXPECT_LT(s.bent, 0.05); // only along the edges
    EXPECT_EQ(s.wrong, 0);
    EXPECT_LT(s.two_sided, 0.001);
}

// Points are 0.014 apart. Below twice that the fit can no longer tell the two sides apart.
TEST(EstimateNormals, AThinSlab) {
    for (const double thickness : {0.1, 0.05, 0.03}) {
        const Score s = score("slab " + std::to_string(thickness), box(40000, {1, 1, thickness / 2}));
        EXPECT_LT(s.bent, 0.06);
        EXPECT_LT(s.wrong, 0.002);
        EXPECT_LT(s.two_sided, 0.002);
    }
}

TEST(EstimateNormals, TwoParallelSheets) {
    for (const double gap : {0.2, 0.05}) {
        Truth truth;
        Random random;
        for (int i = 0; i < 40000; ++i)
            truth.add({2 * random(), i % 2 == 0 ? gap : 0.0, 2 * random()}, {0, i % 2 == 0 ? 1 : -1, 0});
        const Score s = score("sheets " + std::to_string(gap), truth);
        EXPECT_LT(s.bent, 0.001);
        EXPECT_EQ(s.wrong, 0);
        EXPECT_EQ(s.two_sided, 0);
    }
}

// From outside only the outer wall is visible; the sign of the inner wall is undetermined.
TEST(EstimateNormals, AHollowBall) {
    const Score s = score(two_spheres(20000));
    EXPECT_EQ(s.bent, 0);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_NEAR(s.two_sided, 0.5, 0.001);
}

// Drums that consist of the vertices of their rims, as in a CAD model: through their sides the backs of others are
// visible.
TEST(EstimateNormals, CurvesAreNoSurface) {
    Truth truth;
    for (int drum = 0; drum < 27; ++drum)
        for (int side = -1; side <= 1; side += 2)
            for (int i = 0; i < 60; ++i) {
                const double a = 2 * kPi * i / 60, r = 0.3 + 0.02 * (drum % 7);
                const glm::dvec3 centre(drum % 3, drum / 3 % 3, drum / 9);
                const glm::dvec3 out(std::cos(a), std::sin(a), side);
                truth.add(centre + out * glm::dvec3(r, r, 0.4), out / std::sqrt(2.0));
            }
    const Score s = score(truth);
    EXPECT_LT(s.wrong, 0.1);
    EXPECT_GT(s.two_sided, 0.4);
}

TEST(EstimateNormals, AnOpenPlaneFacesUp) {
    const Score s = score(terrain(20000, 0));
    EXPECT_EQ(s.bent, 0);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_EQ(s.two_sided, 0);
}

TEST(EstimateNormals, ATerrainFacesUp) {
    const Score s = score(terrain(20000, 1));
    EXPECT_EQ(s.bent, 0);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_LT(s.two_sided, 0.001);
}

TEST(EstimateNormals, AViewpointTurnsThemAll) {
    Truth truth = sphere(20000);
    for (glm::dvec3 &n : truth.normals)
        n = -n;
    PointRequest request;
    request.viewpoint = {0.1, 0, 0};
    const Score s = score(truth, request);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_EQ(s.two_sided, 0);
}

// A sphere that one scanner saw from within, and another one from outside: on each side of a plane through its centre.
Truth two_scanners(std::size_t count) {
    Truth truth = sphere(count);
    truth.points.stations = {{0, 0, 0}, {9, 0, 0}};
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 &p = truth.points.positions[i];
        const std::uint16_t station = p.x < 0.2 ? 0 : 1;
        truth.points.station_ids.push_back(station);
        if (station == 0)
            truth.normals[i] = -truth.normals[i];
    }
    return truth;
}

TEST(EstimateNormals, EachPointFacesItsScanner) {
    const Score s = score(two_scanners(20000));
    EXPECT_EQ(s.wrong, 0);
    EXPECT_EQ(s.two_sided, 0);
}

TEST(EstimateNormals, PointsWithoutAScannerFollowTheirNeighbours) {
    Truth truth = two_scanners(20000);
    for (std::size_t i = 0; i < truth.normals.size(); i += 10)
        if (std::abs(truth.points.positions[i].x - 0.2) > 0.1)
            truth.points.station_ids[i] = kNoStation;
    const Score s = score(truth);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_LT(s.two_sided, 0.001);
}

TEST(EstimateNormals, AViewpointIsStrongerThanScanners) {
    Truth truth = two_scanners(20000);
    for (std::size_t i = 0; i < truth.normals.size(); ++i)
        truth.normals[i] = -truth.points.positions[i];
    PointRequest request;
    request.viewpoint = {0, 0, 0.1};
    EXPECT_EQ(score(truth, request).wrong, 0);
}

TEST(EstimateNormals, GivenNormalsAreKeptAndLendTheirSign) {
    Truth truth = sphere(20000);
    for (std::size_t i = 0; i < truth.normals.size(); ++i) {
        truth.normals[i] = -truth.normals[i]; // inwards, opposite to what visibility from outside suggests
        truth.points.normals.emplace_back(i % 10 == 0 ? glm::vec3(truth.normals[i]) : glm::vec3(0));
    }
    const Score s = score(truth);
    EXPECT_EQ(s.wrong, 0);
    EXPECT_LT(s.worst, 10);
}

// Whether all given normals come back turned, and the report says so.
bool is_turned(const Truth &truth, const PointRequest &request = {}) {
    Surface points = truth.points;
    for (const glm::dvec3 &n : truth.normals)
        points.normals.emplace_back(n);
    BuildStatistics statistics;
    const VertexNormals found = value_of(estimate_normals(points, request, 2, statistics));
    const bool said = std::any_of(statistics.attributes.begin(), statistics.attributes.end(),
                                  [](const AttributeReport &line) { return line.warning == Warning::turned_normals; });
    for (std::size_t i = 0; i < truth.normals.size(); ++i) {
        const ShortNormal &n = found.normals[i];
        const glm::dvec3 &t = truth.normals[i];
        EXPECT_EQ(n[0] * t.x + n[1] * t.y + n[2] * t.z < 0, said) << i;
    }
    return said;
}

TEST(GivenNormals, OfAnObjectAreTurnedIfAllPointIntoIt) {
    for (Truth truth : {sphere(20000), box(20000, {1, 2, 3})}) {
        EXPECT_FALSE(is_turned(truth));
        for (glm::dvec3 &n : truth.normals)
            n = -n;
        EXPECT_TRUE(is_turned(truth));
        PointRequest keep;
        keep.keep_signs = true;
        EXPECT_FALSE(is_turned(truth, keep));
        truth.points.stations = {{0, 0, 0}};
        truth.points.station_ids.assign(truth.normals.size(), 0);
        EXPECT_FALSE(is_turned(truth)) << "a scanner saw them from within";
    }
}

TEST(GivenNormals, OfRoomsAndOfScansThatShowMoreStay) {
    Truth room = box(20000, {3, 3, 3});
    for (glm::dvec3 &n : room.normals)
        n = -n;
    Truth furnished = room;
    const Truth furniture = sphere(5000);
    for (std::size_t i = 0; i < furniture.normals.size(); ++i)
        furnished.add(furniture.points.positions[i], furniture.normals[i]);
    EXPECT_FALSE(is_turned(furnished));
    for (std::size_t i = 0; i < room.normals.size(); i += 10)
        room.normals[i] = -room.normals[i];
    EXPECT_FALSE(is_turned(room)) << "a tenth of them points outwards";
}

TEST(EstimateNormals, TheAmmonite) {
    const sample::TriangleMesh mesh = sample::make_ammonite({.vertices = 50000, .on_stage = {}});
    Surface surface;
    for (const auto &p : mesh.position)
        surface.positions.emplace_back(p[0], p[1], p[2]);
    for (const auto &t : mesh.triangle)
        surface.triangles.emplace_back(t[0], t[1], t[2]);
    Truth truth;
    surface.crease_angle = glm::radians(180.0); // one normal per vertex
    const VertexNormals normals = value_of(vertex_normals(surface, 2));
    for (std::size_t i = 0; i < normals.normals.size(); ++i)
        truth.add(surface.positions[i],
                  glm::dvec3(normals.normals[i][0], normals.normals[i][1], normals.normals[i][2]) / kNormalScale);
    const Score s = score(truth);
    EXPECT_LT(s.bent, 0.04);
    EXPECT_LT(s.wrong, 0.01);
    EXPECT_LT(s.two_sided, 0.01);
}

} // namespace
