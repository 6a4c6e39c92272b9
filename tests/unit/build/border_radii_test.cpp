// Splats end where a mesh ends, and nowhere else.
#include "pbm_build/radii/border_radii.h"

#include "built_models.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_format/model/point_values.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// Strips of 1 x kStripWidth beside each other along x, with `gap` between them, turned by `angle` around z.
constexpr double kStripWidth = 0.05;
Surface strips(unsigned count, double gap, double angle) {
    Surface surface;
    for (unsigned i = 0; i < count; ++i) {
        const double left = i * (1 + gap);
        for (unsigned corner = 0; corner < 4; ++corner) {
            const double x = left + corner % 2, y = corner < 2 ? 0 : kStripWidth;
            surface.positions.emplace_back(x * std::cos(angle) - y * std::sin(angle),
                                           x * std::sin(angle) + y * std::cos(angle), 0.05 * y);
        }
        surface.triangles.emplace_back(4 * i, 4 * i + 1, 4 * i + 3);
        surface.triangles.emplace_back(4 * i, 4 * i + 3, 4 * i + 2);
    }
    return surface;
}

struct Disc {
    glm::dvec2 centre; // before the strips were turned
    double radius;
    std::uint8_t index;
};

std::vector<Disc> discs_of(const Model &model, double angle) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.point_count()));
    const Grid &grid = model.parameters.grid;
    std::vector<Disc> discs;
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto voxel = morton_decode(codes[i]);
        const double x = grid.origin[0] + (voxel[0] + 0.5) * grid.voxel_size;
        const double y = grid.origin[1] + (voxel[1] + 0.5) * grid.voxel_size;
        const std::uint8_t index = model.levels.back().points.radii[i];
        discs.push_back({{x * std::cos(angle) + y * std::sin(angle), y * std::cos(angle) - x * std::sin(angle)},
                         radius_fraction(index) * grid.edge(),
                         index});
    }
    return discs;
}

// How far discs reach in +x on the line y.
double reach_at(const std::vector<Disc> &discs, double y) {
    double reach = 0;
    for (const Disc &disc : discs)
        if (const double off = std::fabs(disc.centre.y - y); off < disc.radius)
            reach = std::max(reach, disc.centre.x + std::sqrt(disc.radius * disc.radius - off * off));
    return reach;
}

class Borders : public testing::TestWithParam<double> {}; // an angle
INSTANTIATE_TEST_SUITE_P(Angles, Borders, testing::Values(0.0, 0.1, 0.5, M_PI / 4));

TEST_P(Borders, SplatsEndAtTheBorderOnAverage) {
    const double angle = GetParam();
    const Model model = built(strips(1, 0, angle), {});
    const std::vector<Disc> discs = discs_of(model, angle);
    const double voxel = model.parameters.grid.voxel_size;
    double sum = 0, lowest = 1, highest = -1;
    constexpr int kLines = 200;
    for (int line = 0; line < kLines; ++line) {
        const double off = (reach_at(discs, kStripWidth * (0.1 + 0.8 * (line + 0.5) / kLines)) - 1) / voxel;
        sum += off / kLines;
        lowest = std::min(lowest, off);
        highest = std::max(highest, off);
    }
    EXPECT_NEAR(sum, 0, 0.2);
    EXPECT_GT(lowest, -0.7);
    EXPECT_LT(highest, 0.8);
}

TEST_P(Borders, AllOfTheSurfaceInsideIsCovered) {
    const double angle = GetParam();
    const Model model = built(strips(1, 0, angle), {});
    const std::vector<Disc> discs = discs_of(model, angle);
    const double inside = 0.6 * model.parameters.grid.voxel_size;
    constexpr int kPlaces = 150;
    for (int place = 0; place < kPlaces; ++place) {
        const glm::dvec2 at(1 - inside * (1 + 5.0 * place / kPlaces), kStripWidth * (0.1 + 0.8 * place / kPlaces));
        EXPECT_TRUE(std::any_of(discs.begin(), discs.end(),
                                [&](const Disc &disc) { return glm::length(disc.centre - at) <= disc.radius; }))
            << at.x << " " << at.y;
    }
}

TEST_P(Borders, ACrackIsNoBorder) {
    const double angle = GetParam();
    const Model model = built(strips(2, 0.0005, angle), {}); // the voxels have 0.001 to 0.002
    const std::uint8_t dense = dense_radius(model.parameters.grid.depth);
    const double voxel = model.parameters.grid.voxel_size;
    std::size_t at_crack = 0, shrunk = 0;
    for (const Disc &disc : discs_of(model, angle)) {
        const bool is_there =
            std::fabs(disc.centre.x - 1) < 0.5 * voxel && std::fabs(disc.centre.y / kStripWidth - 0.5) < 0.4;
        at_crack += is_there ? 1 : 0;
        shrunk += is_there && disc.index < dense ? 1 : 0;
    }
    EXPECT_GT(at_crack, 20U);
    EXPECT_EQ(shrunk, 0U);
}

TEST(BorderRadii, AGivenDepthAndLooseFacesKeepTheirs) {
    const auto smallest = [](const Model &model) {
        const Bytes &radii = model.levels.back().points.radii;
        return *std::min_element(radii.begin(), radii.end());
    };
    EXPECT_EQ(smallest(built(strips(1, 0, 0.1), at_depth(8))), dense_radius(8));
    Surface loose; // triangles of a voxel
    for (unsigned row = 0; row < 200; ++row)
        for (unsigned column = 0; column < 200; ++column) {
            const double x = 0.01 * column, y = 0.01 * row;
            const auto first = static_cast<unsigned>(loose.positions.size());
            loose.positions.insert(loose.positions.end(), {{x, y, 0}, {x + 0.003, y, 0}, {x, y + 0.003, 0}});
            loose.triangles.emplace_back(first, first + 1, first + 2);
        }
    const Model model = built(std::move(loose), {});
    EXPECT_EQ(smallest(model), dense_radius(model.parameters.grid.depth));
}

TEST(BorderRadii, NeitherThreadsNorTheOrderOfFacesChangeThem) {
    BuildOptions threads;
    threads.threads = 3;
    Surface turned = strips(1, 0, 0.3);
    std::swap(turned.triangles[0], turned.triangles[1]);
    for (glm::uvec3 &t : turned.triangles)
        t = {t.y, t.z, t.x};
    EXPECT_EQ(file_of(built(std::move(turned), threads)), file_of(built(strips(1, 0, 0.3), {})));
}

} // namespace
