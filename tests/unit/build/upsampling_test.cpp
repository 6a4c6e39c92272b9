// Up-sampling: where points are made, how far they lie from the true surface, and what they take from their neighbours.
#include "pbm_build/upsampling/moving_least_squares.h"
#include "pbm_build/upsampling/upsample.h"
#include "unit/build/built_models.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// 128 voxels of edge 1 around the origin.
constexpr Grid kCloudGrid{.depth = 7, .origin = {-64, -64, -64}, .voxel_size = 1};

struct Cloud {
    Surface surface;
    VertexNormals normals;

    void add(const glm::dvec3 &p, const glm::dvec3 &normal) {
        surface.positions.push_back(p);
        normals.normals.push_back(to_short_normal(normal));
        surface.normals.emplace_back(normal);
    }
    std::vector<glm::dvec3> made(int gap, int threads = 2) {
        const std::size_t given = surface.positions.size();
        const auto voxels = upsample(surface, normals, kCloudGrid, {gap, 1 << 30}, threads);
        EXPECT_TRUE(voxels.ok());
        EXPECT_EQ(surface.positions.size(), given + voxels->size());
        EXPECT_EQ(normals.normals.size(), given + voxels->size());
        return {surface.positions.begin() + static_cast<std::ptrdiff_t>(given), surface.positions.end()};
    }
};

// A ball of 40 voxels with a point to each voxel of its surface, but where `leave_out` holds.
Cloud ball(const std::function<bool(const glm::dvec3 &)> &leave_out) {
    Cloud cloud;
    constexpr double kRadius = 40;
    constexpr int kPoints = 20106; // its area
    for (int i = 0; i < kPoints; ++i) {
        const double z = 1 - (2 * i + 1.0) / kPoints, around = i * 2.399963229728653, r = std::sqrt(1 - z * z);
        const glm::dvec3 n(r * std::cos(around), r * std::sin(around), z);
        if (!leave_out(kRadius * n))
            cloud.add(kRadius * n, n);
    }
    return cloud;
}

// A square of 80 x 80 voxels in the plane z = 0.3 with shaken points.
Cloud square(const std::function<bool(const glm::dvec3 &)> &leave_out) {
    Cloud cloud;
    std::mt19937 random(3);
    const auto shake = [&] { return 0.4 * (static_cast<double>(random()) * 0x1p-32 - 0.5); };
    for (int y = -40; y < 40; ++y)
        for (int x = -40; x < 40; ++x)
            if (const glm::dvec3 p(x + 0.5 + shake(), y + 0.5 + shake(), 0.3); !leave_out(p))
                cloud.add(p, {0, 0, 1});
    return cloud;
}

double nearest_to(const std::vector<glm::dvec3> &points, const glm::dvec3 &place) {
    double least = 1e30;
    for (const glm::dvec3 &p : points)
        least = std::min(least, glm::length(p - place));
    return least;
}

TEST(Upsampling, MadePointsHaveNoValueOfAField) {
    Cloud cloud = ball([](const glm::dvec3 &p) { return p.z > 0 && std::hypot(p.x, p.y) < 3; });
    cloud.surface.field_values[0].assign(cloud.surface.positions.size(), {5});
    const std::size_t given = cloud.surface.positions.size(), made = cloud.made(8).size();
    ASSERT_GT(made, 0U);
    ASSERT_EQ(cloud.surface.field_values[0].size(), given + made);
    for (std::size_t i = given; i < given + made; ++i)
        EXPECT_TRUE(std::isnan(cloud.surface.field_values[0][i].number));
}

TEST(Upsampling, PointsInAGapLieOnTheSurface) {
    const glm::dvec3 pole(0, 0, 40);
    Cloud cloud = ball([&](const glm::dvec3 &p) { return glm::length(p - pole) < 3; });
    const std::size_t given = cloud.surface.positions.size();
    const std::vector<glm::dvec3> made = cloud.made(8);
    EXPECT_LT(nearest_to(made, pole), 0.8);
    for (std::size_t i = 0; i < made.size(); ++i) {
        EXPECT_NEAR(glm::length(made[i]), 40, 0.02) << "the chord of the gap is 0.11 below the ball";
        const ShortNormal &n = cloud.normals.normals[given + i];
        EXPECT_GT(glm::dot(glm::dvec3(n[0], n[1], n[2]) / kNormalScale, glm::normalize(made[i])), std::cos(0.03));
    }
}

TEST(Upsampling, EachEmptyVoxelGetsOnePointAtMost) {
    Cloud cloud = ball([](const glm::dvec3 &p) { return p.z > 0 && static_cast<int>(p.x + 100) % 4 < 2; });
    cloud.made(6);
    std::set<MortonCode> codes;
    const std::vector<LatticePoint> lattice = to_lattice(cloud.surface.positions, kCloudGrid, 1);
    std::size_t repeated = 0;
    for (const LatticePoint &p : lattice)
        repeated += codes.insert(code_of(voxel_of(p))).second ? 0 : 1;
    const Cloud before = ball([](const glm::dvec3 &p) { return p.z > 0 && static_cast<int>(p.x + 100) % 4 < 2; });
    std::set<MortonCode> given;
    for (const LatticePoint &p : to_lattice(before.surface.positions, kCloudGrid, 1))
        given.insert(code_of(voxel_of(p)));
    EXPECT_EQ(repeated, before.surface.positions.size() - given.size());
}

TEST(Upsampling, AHoleLargerThanTheGapStays) {
    const auto in_hole = [](const glm::dvec3 &p) { return std::hypot(p.x, p.y) < 5; };
    EXPECT_GT(nearest_to(square(in_hole).made(4), {0, 0, 0.3}), 4);
    EXPECT_LT(nearest_to(square(in_hole).made(12), {0, 0, 0.3}), 0.8);
}

TEST(Upsampling, AStripAsWideAsTheGapIsFilledAndAWiderOneIsNot) {
    const auto in_strip = [](double width) {
        return [width](const glm::dvec3 &p) { return std::fabs(p.x) < width / 2; };
    };
    EXPECT_LT(nearest_to(square(in_strip(4)).made(6), {0, 0, 0.3}), 0.8);
    EXPECT_GT(nearest_to(square(in_strip(8)).made(6), {0, 0, 0.3}), 3);
}

TEST(Upsampling, BordersDoNotGrow) {
    std::mt19937 random(5);
    Cloud cloud = square([&](const glm::dvec3 &) { return random() % 3 == 0; });
    double widest = 0;
    for (const glm::dvec3 &p : cloud.surface.positions)
        widest = std::max({widest, std::fabs(p.x), std::fabs(p.y)});
    const std::vector<glm::dvec3> made = cloud.made(16);
    EXPECT_GT(made.size(), 1000U);
    for (const glm::dvec3 &p : made) {
        EXPECT_LE(std::max(std::fabs(p.x), std::fabs(p.y)), widest + 1e-3);
        EXPECT_NEAR(p.z, 0.3, 1e-3);
    }
}

TEST(Upsampling, SheetsAreNotJoined) {
    Cloud cloud = square([](const glm::dvec3 &p) { return std::fabs(p.x) < 2; });
    const Cloud other = cloud;
    for (const glm::dvec3 &p : other.surface.positions) // faces the other way, three voxels above
        cloud.add(p + glm::dvec3(0, 0, 3), {0, 0, -1});
    const std::vector<glm::dvec3> made = cloud.made(6);
    EXPECT_LT(nearest_to(made, {0, 0, 0.3}), 0.8);
    EXPECT_LT(nearest_to(made, {0, 0, 3.3}), 0.8);
    for (const glm::dvec3 &p : made)
        EXPECT_LT(std::min(std::fabs(p.z - 0.3), std::fabs(p.z - 3.3)), 1e-3);
}

TEST(Upsampling, AttributesAreInterpolated) {
    Cloud cloud = square([](const glm::dvec3 &p) { return std::fabs(p.x) < 2; });
    Surface &surface = cloud.surface;
    for (const glm::dvec3 &p : surface.positions) {
        surface.colours.push_back(p.x < 0 ? Rgb8{0, 255, 10} : Rgb8{255, 0, 10});
        surface.radii.push_back(p.x < 0 ? 1.0F : 3.0F);
        std::uint8_t number = 0;
        for_byte_attributes([&](auto &values) { values.push_back(p.x < 0 ? ++number : 0); }, surface);
    }
    const std::size_t given = surface.positions.size();
    cloud.made(6);
    std::size_t between = 0;
    for (std::size_t i = given; i < surface.positions.size(); ++i) {
        const bool left = surface.positions[i].x < 0;
        EXPECT_EQ(surface.colours[i][2], 10);
        std::uint8_t number = 0;
        for_byte_attributes([&](const auto &values) { EXPECT_EQ(values[i], left ? ++number : 0); }, surface);
        if (std::fabs(surface.positions[i].x) < 1) {
            ++between;
            EXPECT_GT(surface.radii[i], 1.2F);
            EXPECT_LT(surface.radii[i], 2.8F);
            EXPECT_GT(surface.colours[i][0], 0);
            EXPECT_GT(surface.colours[i][1], 0);
        }
    }
    EXPECT_GT(between, 80U);
    remove_made_points(surface, cloud.normals, given);
    EXPECT_EQ(surface.positions.size(), given);
    EXPECT_EQ(surface.colours.size(), given);
    EXPECT_EQ(surface.two_sided.size(), given);
    EXPECT_EQ(cloud.normals.normals.size(), given);
}

TEST(Upsampling, MorePointsThanMemoryAllowsAreRefused) {
    Cloud cloud = square([](const glm::dvec3 &p) { return std::fabs(p.x) < 2; });
    const auto refused = upsample(cloud.surface, cloud.normals, kCloudGrid, {6, 5000}, 2);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::memory);
}

Surface sparse_ball() {
    Surface surface = ball([](const glm::dvec3 &p) { return static_cast<int>(8 * p.x + 8000) % 3 > 0; }).surface;
    surface.normals.clear();
    return surface;
}

TEST(Upsampling, NeitherThreadsNorTheOrderOfPointsChangeAByte) {
    const Surface surface = sparse_ball();
    BuildOptions options;
    options.upsample = 5;
    options.threads = 1;
    const Bytes file = file_of(built(surface, options));
    EXPECT_NE(file, file_of(built(surface, {}))) << "points are made";
    Surface shuffled = surface;
    std::mt19937 random(1);
    std::shuffle(shuffled.positions.begin(), shuffled.positions.end(), random);
    for (const int threads : {2, 7}) {
        options.threads = threads;
        EXPECT_EQ(file_of(built(shuffled, options)), file);
    }
}

TEST(Upsampling, MadePointsAreReported) {
    BuildOptions options;
    options.upsample = 5;
    options.strict = true;
    BuildStatistics statistics;
    const Model model = built(sparse_ball(), options, &statistics);
    EXPECT_GT(statistics.made_points, 1000U);
    const AttributeReport &line = statistics.attributes.back();
    EXPECT_EQ(line.name, "upsampling");
    EXPECT_EQ(line.fate, Fate::estimated);
    EXPECT_EQ(line.note, std::to_string(statistics.made_points) + " points made in gaps of up to 5 voxels");
    EXPECT_NE(model.metadata.find("\"upsample\":5"), std::string::npos);
    EXPECT_NE(to_json(statistics, {}, "x").find("\"made_points\": " + std::to_string(statistics.made_points)),
              std::string::npos);
}

TEST(Upsampling, AMeshHasNoGaps) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    surface.triangles = {{0, 1, 2}};
    BuildOptions options;
    options.upsample = 5;
    BuildStatistics statistics;
    built(surface, options, &statistics);
    EXPECT_EQ(statistics.attributes.back().name, "--upsample");
    EXPECT_EQ(statistics.attributes.back().fate, Fate::dropped);
}

TEST(MovingLeastSquares, FindsAQuadraticSurface) {
    std::vector<WeightedPoint> points;
    for (int i = 0; i < 30; ++i) {
        const double u = std::cos(i * 2.4) * i / 30, v = std::sin(i * 2.4) * i / 30;
        points.push_back({{u, v, 0.25 + 0.1 * u * u - 0.2 * u * v}, {0, 0, 1}, 1 - i * 0.02});
    }
    const auto foot = moving_least_squares(points);
    ASSERT_TRUE(foot);
    EXPECT_NEAR(foot->offset.z, 0.25, 1e-4);
    EXPECT_NEAR(foot->normal.z, 1, 1e-4);
}

TEST(MovingLeastSquares, PointsOnALineHaveNoSurface) {
    std::vector<WeightedPoint> points;
    points.reserve(9);
    for (int i = 0; i < 9; ++i)
        points.push_back({{i * 0.1, 0, 0}, {0, 0, 1}, 1});
    EXPECT_FALSE(moving_least_squares(points));
    EXPECT_FALSE(moving_least_squares(std::span(points).first(2)));
}

} // namespace
