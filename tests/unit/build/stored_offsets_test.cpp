// Which voxels get a stored surface offset, and how true it is. BVG.md 19.6 and 19.7
#include "built_models.h"
#include "pbm_build/offsets/stored_offsets.h"
#include "pbm_format/model/normal.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <cmath>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

constexpr double kBallRadius = 1;

// A ball with bumps: flat faces of a grid of `steps` x 2 `steps` quads between meridians and parallels.
Surface bumpy_ball(unsigned steps) {
    Surface surface;
    const unsigned around = 2 * steps;
    for (unsigned row = 0; row <= steps; ++row)
        for (unsigned column = 0; column < around; ++column) {
            const double latitude = M_PI * row / steps, longitude = 2 * M_PI * column / around;
            const double radius = kBallRadius + 0.04 * std::sin(9 * latitude) * std::sin(9 * longitude);
            surface.positions.emplace_back(radius * std::sin(latitude) * std::cos(longitude),
                                           radius * std::sin(latitude) * std::sin(longitude),
                                           radius * std::cos(latitude));
        }
    for (unsigned row = 0; row < steps; ++row)
        for (unsigned column = 0; column < around; ++column) {
            const unsigned next = (column + 1) % around, a = row * around + column, b = row * around + next;
            if (row > 0)
                surface.triangles.emplace_back(a, a + around, b);
            if (row + 1 < steps)
                surface.triangles.emplace_back(b, a + around, b + around);
        }
    return surface;
}

// A ball whose corners lie on a sphere, so that its faces do within `sagitta`.
Surface ball(unsigned steps) {
    Surface surface = bumpy_ball(steps);
    for (glm::dvec3 &position : surface.positions)
        position *=
            kBallRadius / std::sqrt(position.x * position.x + position.y * position.y + position.z * position.z);
    return surface;
}

BuildOptions at_chosen_depth(int threads = 2) {
    BuildOptions options;
    options.threads = threads;
    return options;
}

TEST(StoredOffsets, LeadToTheSurface) {
    const Model model = built(ball(128), at_chosen_depth());
    const int depth = model.parameters.grid.depth;
    const Level &finest = model.levels.back();
    LevelMasks masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    std::vector<MortonCode> codes{0};
    for (int level = 1; level <= depth; ++level)
        codes = value_of(expand_level(codes, masks[static_cast<std::size_t>(level)], model.point_count()));
    ASSERT_GT(finest.offsets.size(), 1000U);
    const Grid &grid = model.parameters.grid;
    double squares = 0;
    for (std::size_t i = 0; i < finest.offsets.size(); ++i) {
        const std::uint32_t point = finest.offsets.points[i];
        const auto voxel = morton_decode(codes[point]);
        const UnitVector &normal = normal_table()[finest.points.normals[point] & kNormalIndexMask];
        double radius = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double centre = grid.origin[axis] + (voxel[axis] + 0.5) * grid.voxel_size;
            const double at = centre + finest.offsets.values[i] * grid.voxel_size / Offsets::kSteps *
                                           static_cast<double>(normal[axis]);
            radius += at * at;
        }
        const double error = (std::sqrt(radius) - kBallRadius) / grid.voxel_size;
        squares += error * error;
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(finest.offsets.size())), 0.08); // voxels
}

TEST(StoredOffsets, AreThoseOfTheFinestLevelOfAChosenDepthAlone) {
    const Model model = built(bumpy_ball(64), at_chosen_depth());
    EXPECT_GT(model.levels.back().offsets.size(), 1000U);
    for (std::size_t level = 0; level + 1 < model.levels.size(); ++level)
        EXPECT_EQ(model.levels[level].offsets.size(), 0U) << level;
    const Model given = built(bumpy_ball(64), at_depth(model.parameters.grid.depth));
    EXPECT_EQ(given.levels.back().offsets.size(), 0U);
    Model without = model;
    without.levels.back().offsets = {};
    EXPECT_TRUE(without.levels == given.levels);
}

TEST(StoredOffsets, OfPointsAloneAreNotKnown) {
    Surface points = bumpy_ball(64);
    points.triangles.clear();
    EXPECT_EQ(built(std::move(points), at_chosen_depth()).levels.back().offsets.size(), 0U);
}

// A plane between two layers of voxels lies half a voxel from the centres of all of them, where no estimate finds it.
TEST(StoredOffsets, APlaneBetweenVoxelsIsMovedAsAWhole) {
    Surface plane;
    for (unsigned corner = 0; corner < 4; ++corner)
        plane.positions.emplace_back(corner % 2, corner / 2, 0);
    plane.triangles = {{0, 1, 3}, {0, 3, 2}};
    const Model model = built(std::move(plane), at_chosen_depth());
    const Offsets &offsets = model.levels.back().offsets;
    EXPECT_EQ(offsets.size(), model.point_count());
    EXPECT_EQ(std::abs(offsets.values.front()), Offsets::kSteps / 2);
    EXPECT_EQ(offsets.values, std::vector<std::int8_t>(offsets.size(), offsets.values.front()));
}

TEST(StoredOffsets, ThreadsChangeNothing) {
    const Bytes two = file_of(built(bumpy_ball(64), at_chosen_depth(2)));
    EXPECT_EQ(file_of(built(bumpy_ball(64), at_chosen_depth(5))), two);
}

} // namespace
