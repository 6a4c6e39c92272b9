// Which voxels get two sides, and what of them. BVG.md 19.5
#include "built_models.h"
#include "pbm_build/voxels/voxel_sums.h"

#include <algorithm>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// Two squares of 40 x 40 quads, `gap` apart: the upper one red and seen from above, the lower one blue and seen from
// below.
Surface card(double gap) {
    Surface surface;
    constexpr unsigned kQuads = 40;
    for (const double z : {gap, 0.0})
        for (unsigned y = 0; y <= kQuads; ++y)
            for (unsigned x = 0; x <= kQuads; ++x) {
                surface.positions.emplace_back(x / double{kQuads}, y / double{kQuads}, z);
                surface.colours.push_back(z > 0 ? Rgb8{220, 40, 40} : Rgb8{40, 40, 220});
            }
    for (unsigned side = 0; side < 2; ++side)
        for (unsigned y = 0; y < kQuads; ++y)
            for (unsigned x = 0; x < kQuads; ++x) {
                const unsigned a = (side * (kQuads + 1) + y) * (kQuads + 1) + x, b = a + 1, c = a + kQuads + 1,
                               d = c + 1;
                surface.triangles.push_back(side == 0 ? glm::uvec3(a, b, d) : glm::uvec3(a, d, b));
                surface.triangles.push_back(side == 0 ? glm::uvec3(a, d, c) : glm::uvec3(a, c, d));
            }
    // A speck above moves the card away from the middle of the grid, which no node crosses.
    const auto first = static_cast<unsigned>(surface.positions.size());
    for (const glm::dvec3 at : {glm::dvec3(0, 0, 0.37), glm::dvec3(0.02, 0, 0.37), glm::dvec3(0, 0.02, 0.37)}) {
        surface.positions.push_back(at);
        surface.colours.push_back({220, 40, 40});
    }
    surface.triangles.emplace_back(first, first + 1, first + 2);
    return surface;
}

// The share of a level's points that have a red side above and a blue one below.
double two_coloured(const Model &model, std::size_t level) {
    const Sides &sides = model.levels[level].sides;
    std::size_t count = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const auto is_up = [&](std::size_t at) { return normal_table()[sides.values.normals[at]][2] > 0; };
        const std::size_t above = is_up(2 * i) ? 2 * i : 2 * i + 1, below = is_up(2 * i) ? 2 * i + 1 : 2 * i;
        const auto colour = [&](std::size_t at) {
            return point_colour(sides.values.colours, at, model.parameters.attributes.colour);
        };
        count += is_up(above) && !is_up(below) && colour(above)[0] > 200 && colour(above)[2] < 60 &&
                         colour(below)[0] < 60 && colour(below)[2] > 200
                     ? 1
                     : 0;
    }
    return static_cast<double>(count) / static_cast<double>(model.levels[level].points.size());
}

TEST(BuiltSides, FacesInOnePlaceKeepBothColoursAtEveryLevel) {
    const Model model = built(card(1e-4), at_depth(7));
    for (std::size_t level = 4; level < model.levels.size(); ++level)
        EXPECT_GT(two_coloured(model, level), 0.9) << level;
}

TEST(BuiltSides, AWallOfSomeVoxelsHasSidesAtCoarserLevelsAlone) {
    const Model model = built(card(0.02), at_depth(8)); // 5 voxels
    EXPECT_EQ(model.levels[8].sides.size(), 0U);
    EXPECT_EQ(model.levels[7].sides.size(), 0U);
    for (const std::size_t level : {4U, 5U})
        EXPECT_GT(two_coloured(model, level), 0.9) << level;
}

TEST(BuiltSides, OneSheetHasNone) {
    Surface sheet = card(1e-4);
    sheet.triangles.erase(sheet.triangles.begin(), sheet.triangles.begin() + 3200);
    const Model model = built(std::move(sheet), at_depth(7));
    for (const Level &level : model.levels)
        EXPECT_EQ(level.sides.size(), 0U);
}

TEST(BuiltSides, ThreadsChangeNothing) {
    BuildOptions options = at_depth(7);
    const Bytes two = file_of(built(card(1e-4), options));
    options.threads = 5;
    EXPECT_EQ(file_of(built(card(1e-4), options)), two);
}

TEST(BuiltSides, SmallGroupsAndCreasesAreNoSides) {
    const auto facing = [](int x, int y, int z, int votes) {
        VoxelSums sums;
        for (int i = 0; i < votes; ++i)
            sums.add_normal({x, y, z}, false);
        return sums;
    };
    const int one = static_cast<int>(kNormalScale);
    EXPECT_TRUE(are_sides(facing(0, 0, one, 7), facing(0, 0, -one, 1)));
    EXPECT_FALSE(are_sides(facing(0, 0, one, 8), facing(0, 0, -one, 1)));
    EXPECT_FALSE(are_sides(facing(0, 0, one, 4), facing(one, 0, 0, 4)));
    EXPECT_FALSE(are_sides(facing(0, 0, one, 4), VoxelSums{}));
}

} // namespace
