// Which points of a cloud lie on a surface, and what becomes of the others.
#include "pbm_build/neighbourhoods/neighbourhoods.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/model/point_values.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

struct Cloud {
    std::mt19937 bits{11};
    Surface surface;

    double uniform() { return static_cast<double>(bits()) * 0x1p-32; }
    void add(double x, double y, double z) { surface.positions.emplace_back(x, y, z); }
    void add_sheet(std::size_t count, double noise) { // from (0, 0) to (1, 1)
        for (std::size_t i = 0; i < count; ++i) {
            const double x = uniform(), y = uniform();
            add(x, y, 0.05 * std::sin(6 * x) + noise * (uniform() + uniform() - 1));
        }
    }
    void add_crown(std::size_t count) { // a ball of leaves above the sheet
        while (count > 0) {
            const glm::dvec3 p(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5);
            if (glm::dot(p, p) > 0.25)
                continue;
            add(0.5 + 0.5 * p.x, 0.5 + 0.5 * p.y, 0.6 + 0.5 * p.z);
            --count;
        }
    }
    void add_relief(std::size_t count) { // from (0, 0) to (1, 1)
        for (std::size_t i = 0; i < count; ++i) {
            const double x = uniform(), y = uniform();
            add(x, y, 0.03 * std::sin(25 * x) * std::sin(25 * y));
        }
    }
    void add_shell(std::size_t count) { // around the crown
        for (std::size_t i = 0; i < count; ++i) {
            const double z = 2 * uniform() - 1, angle = 6.283185 * uniform(), r = 0.4 * std::sqrt(1 - z * z);
            add(0.5 + r * std::cos(angle), 0.5 + r * std::sin(angle), 0.6 + 0.4 * z);
        }
    }
    void add_wire(std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            const double t = static_cast<double>(i) / static_cast<double>(count);
            add(t, 0.5, 1.2 + 0.2 * (t - 0.5) * (t - 0.5));
        }
    }
    // The surface of a star with blunt rays, which few points describe badly.
    void add_star(std::size_t count) {
        while (count > 0) {
            const glm::dvec3 p(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5);
            if (glm::dot(p, p) > 0.25 || glm::dot(p, p) < 0.01)
                continue;
            const glm::dvec3 n = glm::normalize(p);
            const double radius = 0.4 + 0.1 * std::sin(6 * n.x) * std::sin(6 * n.y) * std::sin(6 * n.z);
            add(radius * n.x, radius * n.y, radius * n.z);
            --count;
        }
    }
    void shuffle() { std::shuffle(surface.positions.begin(), surface.positions.end(), bits); }
};

BuildOptions options_at(int depth) {
    BuildOptions options = at_depth(depth);
    options.grid.up = UpAxis::z;
    return options;
}

// Calls work(index, centre in model units) for each voxel.
template <class Work> void for_points(const Model &model, const Work &work) {
    const Grid &grid = model.parameters.grid;
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.levels.back().points.size()));
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto at = morton_decode(codes[i]);
        work(i, glm::dvec3(grid.origin[0] + (at[0] + 0.5) * grid.voxel_size,
                           grid.origin[1] + (at[1] + 0.5) * grid.voxel_size,
                           grid.origin[2] + (at[2] + 0.5) * grid.voxel_size));
    }
}

// Share of the voxels with min <= z < max (model units) that are round.
double round_share(const Model &model, double min, double max) {
    const PointAttributes &points = model.levels.back().points;
    std::size_t all = 0, round = 0;
    for_points(model, [&](std::size_t i, const glm::dvec3 &at) {
        if (at.z < min || at.z >= max)
            return;
        ++all;
        const Material &material = model.parameters.materials[points.materials.empty() ? 0 : points.materials[i]];
        round += is_round(material) ? 1 : 0;
        EXPECT_TRUE(!is_round(material) || (points.normals[i] & kTwoSidedBit) != 0);
    });
    return static_cast<double>(round) / static_cast<double>(std::max<std::size_t>(all, 1));
}

TEST(Neighbourhoods, CrownsAndWiresAreRoundAndSurfacesAreNot) {
    Cloud cloud;
    cloud.add_sheet(6000, 0.002);
    cloud.add_crown(3000);
    cloud.add_wire(300);
    const Model model = built(cloud.surface, options_at(8));
    EXPECT_LT(round_share(model, -1, 0.2), 0.02);
    EXPECT_GT(round_share(model, 0.4, 0.8), 0.9);
    EXPECT_GT(round_share(model, 1.15, 2), 0.95);
    ASSERT_EQ(model.parameters.materials.size(), 2U);
    const Material &round = model.parameters.materials[1];
    EXPECT_EQ(round.kd, 0);
    EXPECT_EQ(round.ks, 0);
    EXPECT_NEAR(round.ka, Material().ka + Material().kd / 2, 1e-6);
}

// A scanner's noise is as thick as its points are apart: a surface all the same.
TEST(Neighbourhoods, NoisySurfacesArePlanar) {
    Cloud cloud;
    cloud.add_sheet(6000, 1.5 / std::sqrt(6000));
    EXPECT_LT(round_share(built(cloud.surface, options_at(8)), -1, 1), 0.1);
}

TEST(Neighbourhoods, CurvedSurfacesArePlanar) {
    Cloud cloud;
    cloud.add_relief(2500);
    EXPECT_LT(round_share(built(cloud.surface, options_at(8)), -1, 1), 0.05);
}

// Many neighbours of a thin wall lie on its other side, few do not.
TEST(Neighbourhoods, ThinWallsArePlanar) {
    Cloud cloud;
    for (int i = 0; i < 1600; ++i)
        for (const double z : {0.0, 2.6})
            cloud.add(i % 40 + 0.4 * cloud.uniform(), std::floor(i / 40.0) + 0.4 * cloud.uniform(), z);
    EXPECT_LT(round_share(built(cloud.surface, options_at(7)), -10, 10), 0.02);
}

// The nearest ten points of a line are a curve; thirty reach the next line.
TEST(Neighbourhoods, LinesOfAScannerArePlanar) {
    Cloud cloud;
    for (int i = 0; i < 4000; ++i)
        cloud.add(i % 200, 6 * std::floor(i / 200.0), 0);
    EXPECT_LT(round_share(built(cloud.surface, options_at(8)), -10, 10), 0.02);
}

// A statue of few points is as rough as a crown. It is seen from one side all around, and hides none of its points.
TEST(Neighbourhoods, BodiesOfFewPointsArePlanar) {
    Cloud star;
    star.add_star(700);
    EXPECT_EQ(round_share(built(star.surface, options_at(6)), -1, 1), 0);
    Cloud small_crown; // hides few points, and is rough everywhere
    small_crown.add_crown(220);
    EXPECT_GT(round_share(built(small_crown.surface, options_at(6)), -1, 1), 0.9);
    Cloud terrain; // hides few points, and is smooth nearly everywhere; seen from both sides
    terrain.add_sheet(9000, 0.002);
    terrain.add_crown(800);
    EXPECT_GT(round_share(built(terrain.surface, options_at(8)), 0.4, 0.8), 0.9);
    Cloud filled; // is seen from one side, and is smooth nearly everywhere; hides more than a fifth
    filled.add_shell(4000);
    filled.add_crown(1600);
    EXPECT_GT(round_share(built(filled.surface, options_at(8)), 0.5, 0.7), 0.2);
}

TEST(Neighbourhoods, DoNotDependOnThreadsAndOrder) {
    Cloud cloud;
    cloud.add_sheet(2000, 0.01);
    cloud.add_crown(2000);
    BuildOptions options = options_at(8);
    const Bytes file = file_of(built(cloud.surface, options));
    cloud.shuffle();
    options.threads = 1;
    EXPECT_EQ(file_of(built(cloud.surface, options)), file);
}

TEST(Neighbourhoods, PointsWithNormalsAreDiscs) {
    Cloud cloud;
    cloud.add_crown(2000);
    cloud.surface.normals.assign(cloud.surface.positions.size(), {0, 0, 1});
    const Model model = built(cloud.surface, options_at(8));
    EXPECT_EQ(round_share(model, -1, 2), 0);
    EXPECT_FALSE(model.parameters.attributes.material);
}

// A round point ends halfway to its second neighbour, and closes no gap.
TEST(Neighbourhoods, RoundPointsReachHalfwayToTheirNeighbours) {
    Cloud cloud;
    cloud.add_crown(1500);
    const Model model = built(cloud.surface, options_at(9));
    const PointAttributes &points = model.levels.back().points;
    EXPECT_GT(round_share(model, -1, 2), 0.99);
    double mean = 0;
    for (const std::uint8_t radius : points.radii)
        mean += radius_fraction(radius) * model.parameters.grid.edge() / static_cast<double>(points.size());
    const double spacing = std::cbrt(0.0654 / 1500); // of a ball of radius 0.25
    EXPECT_GT(mean, 0.25 * spacing);
    EXPECT_LT(mean, 0.5 * spacing);
}

// A splat at the border of a plane reaches its fifth neighbour, and ends before a leaf that hangs a spacing above it.
TEST(Neighbourhoods, SplatsBesideRoundPointsHideNothingOffTheirPlane) {
    constexpr int kDepth = 8;
    constexpr std::uint32_t kApart = 8;
    const MortonCode leaf = morton_encode(9, 7 * kApart, 109), beside = morton_encode(0, 7 * kApart, 100),
                     far = morton_encode(0, 3 * kApart, 100);
    Voxels voxels;
    voxels.codes.push_back(leaf);
    for (std::uint32_t y = 0; y < 15; ++y)
        for (std::uint32_t x = 0; x < 15; ++x)
            voxels.codes.push_back(morton_encode(kApart * x, kApart * y, 100));
    std::sort(voxels.codes.begin(), voxels.codes.end());
    const auto index = [&](MortonCode code) {
        return static_cast<std::size_t>(std::lower_bound(voxels.codes.begin(), voxels.codes.end(), code) -
                                        voxels.codes.begin());
    };
    voxels.points.resize(voxels.codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    voxels.points.materials.assign(voxels.codes.size(), 0);
    voxels.points.materials[index(leaf)] = 1;
    std::vector<Material> materials(2);
    materials[1].shape = PointShape::round;
    radii_from_neighbours(voxels, materials, kDepth, 2);
    const auto radius_at = [&](MortonCode code) {
        return radius_fraction(voxels.points.radii[index(code)]) * (1 << kDepth);
    };
    EXPECT_GE(radius_at(beside), 8.9);
    EXPECT_LT(radius_at(beside), 9.6);
    EXPECT_GE(radius_at(far), 0.99 * std::hypot(kApart, kApart));
}

TEST(Neighbourhoods, OddClouds) {
    for (const std::size_t count : {1U, 2U, 3U, 50U}) { // on a line, or alone
        Cloud cloud;
        cloud.add_wire(count);
        const Model model = built(cloud.surface, options_at(6));
        EXPECT_EQ(round_share(model, 0, 2), 1) << count;
        EXPECT_FALSE(model.parameters.attributes.material); // one material, and no stream
        EXPECT_GT(model.levels.back().points.radii[0], 0);
    }
    Cloud plane, equal;
    for (int i = 0; i < 900; ++i) {
        plane.add(i % 30, std::floor(i / 30.0), 0);
        equal.add(1, 2, 3);
    }
    EXPECT_EQ(round_share(built(plane.surface, options_at(6)), -100, 100), 0);
    EXPECT_EQ(round_share(built(equal.surface, options_at(6)), -100, 100), 1);
}

// Eight materials leave no room for a round one.
TEST(Neighbourhoods, WithoutRoomForAMaterialPointsStayDiscs) {
    Surface surface;
    surface.materials.resize(kMaxMaterials);
    surface.positions.resize(2);
    EXPECT_FALSE(make_round(surface, std::vector<std::uint8_t>{1, 0}));
    EXPECT_EQ(surface.materials.size(), std::size_t{kMaxMaterials});
    surface.materials.resize(2);
    surface.material_ids = {1, 1};
    EXPECT_TRUE(make_round(surface, std::vector<std::uint8_t>{1, 0}));
    EXPECT_EQ(surface.material_ids, (std::vector<std::uint8_t>{2, 1}));
    EXPECT_TRUE(is_round(surface.materials[2]));
}

} // namespace
