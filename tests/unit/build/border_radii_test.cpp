// Splats end where a mesh ends, and nowhere else.
#include "pbm_build/radii/border_radii.h"

#include "built_models.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_build/radii/tangent_cell.h"
#include "pbm_format/model/point_values.h"
#include "small_meshes.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

constexpr double kStripWidth = 0.05;

glm::dvec3 turned_around_z(const glm::dvec3 &p, double angle) {
    return {p.x * std::cos(angle) - p.y * std::sin(angle), p.x * std::sin(angle) + p.y * std::cos(angle), p.z};
}

// Strips of 1 x `width` beside each other along x, with `gap` between them, turned by `angle` around z. Each has so
// many quads along x.
Surface strips(unsigned count, double gap, double angle, double width = kStripWidth, unsigned quads = 1) {
    Surface surface;
    for (unsigned i = 0; i < count; ++i)
        for (unsigned quad = 0; quad < quads; ++quad) {
            Surface one;
            for (unsigned corner = 0; corner < 4; ++corner) {
                const double x = i * (1 + gap) + static_cast<double>(quad + corner % 2) / quads;
                const double y = corner < 2 ? 0 : width;
                one.positions.push_back(turned_around_z({x, y, 0.05 * y}, angle));
            }
            one.triangles = {{0, 1, 3}, {0, 3, 2}};
            append_faces(surface, one);
        }
    return surface;
}

struct Disc {
    glm::dvec3 centre;
    TangentPlane plane;
    double radius;
    bool is_shrunk;
};

std::vector<Disc> discs_of(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.point_count()));
    const Grid &grid = model.parameters.grid;
    const PointAttributes &points = model.levels.back().points;
    std::vector<Disc> discs;
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto voxel = morton_decode(codes[i]);
        glm::dvec3 centre;
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            centre[axis] = grid.origin[a] + (voxel[a] + 0.5) * grid.voxel_size;
        }
        discs.push_back({centre, TangentPlane(direction_of(points.normals[i])),
                         radius_fraction(points.radii[i]) * grid.edge(), points.radii[i] < dense_radius(grid.depth)});
    }
    return discs;
}

std::size_t shrunk_in(const std::vector<Disc> &discs) {
    return static_cast<std::size_t>(
        std::count_if(discs.begin(), discs.end(), [](const Disc &disc) { return disc.is_shrunk; }));
}

bool is_covered(const std::vector<Disc> &discs, const glm::dvec3 &place, double voxel) {
    return std::any_of(discs.begin(), discs.end(), [&](const Disc &disc) {
        const glm::dvec3 off = disc.centre - place;
        return std::fabs(disc.plane.height(off)) < voxel && glm::length(disc.plane.flat(off)) <= disc.radius;
    });
}

// How far discs of a strip that is turned by `angle` reach along it, on the line y.
double reach_at(const std::vector<Disc> &discs, double y, double angle) {
    double reach = 0;
    for (const Disc &disc : discs) {
        const glm::dvec3 at = turned_around_z(disc.centre, -angle);
        if (const double off = std::fabs(at.y - y); off < disc.radius)
            reach = std::max(reach, at.x + std::sqrt(disc.radius * disc.radius - off * off));
    }
    return reach;
}

class Borders : public testing::TestWithParam<double> {}; // an angle
INSTANTIATE_TEST_SUITE_P(Angles, Borders, testing::Values(0.0, 0.1, 0.5, M_PI / 4));

TEST_P(Borders, SplatsEndAtTheBorderOnAverage) {
    const double angle = GetParam();
    const Model model = built(strips(1, 0, angle), {});
    const std::vector<Disc> discs = discs_of(model);
    const double voxel = model.parameters.grid.voxel_size;
    double sum = 0, lowest = 1, highest = -1;
    constexpr int kLines = 100;
    for (int line = 0; line < kLines; ++line) {
        const double off = (reach_at(discs, kStripWidth * (0.1 + 0.8 * (line + 0.5) / kLines), angle) - 1) / voxel;
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
    const std::vector<Disc> discs = discs_of(model);
    EXPECT_GT(shrunk_in(discs), 100U);
    const double voxel = model.parameters.grid.voxel_size;
    constexpr int kPlaces = 100;
    for (int place = 0; place < kPlaces; ++place) {
        const double x = 1 - 0.6 * voxel * (1 + 5.0 * place / kPlaces), y = kStripWidth * (0.1 + 0.8 * place / kPlaces);
        EXPECT_TRUE(is_covered(discs, turned_around_z({x, y, 0.05 * y}, angle), voxel)) << x << " " << y;
    }
}

TEST_P(Borders, NarrowRibbonsStayClosed) {
    const double angle = GetParam();
    constexpr double kVoxel = 1.0 / 2048; // about that of such a model
    for (const double voxels : {0.3, 0.6, 0.9, 1.2, 1.5, 2.0, 2.5, 3.0}) {
        const double width = voxels * kVoxel;
        const Model model = built(strips(1, 0, angle, width), {});
        const std::vector<Disc> discs = discs_of(model);
        const double voxel = model.parameters.grid.voxel_size;
        constexpr int kPlaces = 100;
        for (int place = 0; place < kPlaces; ++place)
            EXPECT_TRUE(is_covered(
                discs, turned_around_z({0.1 + 0.8 * place / kPlaces, width / 2, 0.05 * width / 2}, angle), voxel))
                << voxels << " " << place;
    }
}

TEST_P(Borders, ACrackIsNoBorder) {
    const double angle = GetParam();
    const Model model = built(strips(2, 0.0005, angle), {}); // the voxels have 0.001 to 0.002
    const double voxel = model.parameters.grid.voxel_size;
    std::size_t at_crack = 0, shrunk = 0, elsewhere = 0;
    for (const Disc &disc : discs_of(model)) {
        const glm::dvec3 at = turned_around_z(disc.centre, -angle);
        const bool is_there = std::fabs(at.x - 1) < 0.5 * voxel && std::fabs(at.y / kStripWidth - 0.5) < 0.4;
        at_crack += is_there ? 1 : 0;
        shrunk += is_there && disc.is_shrunk ? 1 : 0;
        elsewhere += std::fabs(at.x - 1) > 2 * voxel && disc.is_shrunk ? 1 : 0;
    }
    EXPECT_GT(at_crack, 20U);
    EXPECT_EQ(shrunk, 0U);
    EXPECT_GT(elsewhere, 100U);
}

// The faces of a box whose edges are cut in different numbers of pieces, so that no edge has two faces.
TEST_P(Borders, FacesThatMeetWithoutSharedVerticesStayClosed) {
    const double angle = GetParam();
    Surface box;
    unsigned cuts = 1;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {0.0, 0.1}) {
            ++cuts;
            for (unsigned i = 0; i < cuts * cuts; ++i) {
                const unsigned row = i / cuts, column = i % cuts;
                Surface one;
                for (unsigned corner = 0; corner < 4; ++corner) {
                    glm::dvec3 p;
                    p[axis] = side;
                    p[(axis + 1) % 3] = 0.1 * static_cast<double>(column + corner % 2) / cuts;
                    p[(axis + 2) % 3] = 0.1 * static_cast<double>(row + (corner < 2 ? 0 : 1)) / cuts;
                    one.positions.push_back(turned_around_z(p, angle));
                }
                one.triangles = {{0, 1, 3}, {0, 3, 2}};
                append_faces(box, one);
            }
        }
    BuildOptions options;
    options.grid.max_points = 20000;
    const Model model = built(std::move(box), options);
    const std::vector<Disc> discs = discs_of(model);
    const double voxel = model.parameters.grid.voxel_size;
    std::size_t open = 0;
    constexpr int kPlaces = 400;
    for (int place = 0; place < kPlaces; ++place) { // beside an edge, on the two faces in turn
        const double along = 0.1 * (place + 0.5) / kPlaces, off = 0.05 * voxel * (1 + place % 20);
        const glm::dvec3 at = place % 2 == 0 ? glm::dvec3(off, 0, along) : glm::dvec3(0, off, along);
        open += is_covered(discs, turned_around_z(at, angle), voxel) ? 0 : 1;
    }
    EXPECT_LE(open, 4U);
}

std::uint8_t smallest_radius(const Model &model) {
    const Bytes &radii = model.levels.back().points.radii;
    return *std::min_element(radii.begin(), radii.end());
}

TEST(BorderRadii, AGivenDepthAndTinyFacesKeepTheirs) {
    EXPECT_EQ(smallest_radius(built(strips(1, 0, 0.1), at_depth(8))), dense_radius(8));
    EXPECT_LT(smallest_radius(built(strips(1, 0, 0.1), {})), dense_radius(10));
    Surface tiny; // loose triangles of a voxel
    for (unsigned row = 0; row < 200; ++row)
        for (unsigned column = 0; column < 200; ++column) {
            const double x = 0.01 * column, y = 0.01 * row;
            const auto first = static_cast<unsigned>(tiny.positions.size());
            tiny.positions.insert(tiny.positions.end(), {{x, y, 0}, {x + 0.001, y, 0}, {x, y + 0.001, 0}});
            tiny.triangles.emplace_back(first, first + 1, first + 2);
        }
    const Model model = built(std::move(tiny), {});
    EXPECT_EQ(smallest_radius(model), dense_radius(model.parameters.grid.depth));
}

TEST(BorderRadii, RadiiOfTheInputStay) {
    const Surface surface = strips(1, 0, 0.1);
    Voxels voxels;
    voxels.codes = {0};
    voxels.points.normals = {quantise_normal(0, 0, 1)};
    Grid grid{.depth = 8, .origin = {-0.001, -0.001, -0.001}, .voxel_size = 0.002};
    const std::vector<HalfEdge> sides = border_sides(surface, 2);
    EXPECT_EQ(sides.size(), 4U);
    const auto radius_after = [&](std::uint8_t given) {
        voxels.points.radii = {given};
        shrink_at_borders(surface, sides, grid, voxels, 2);
        return voxels.points.radii[0];
    };
    const auto larger = static_cast<std::uint8_t>(dense_radius(8) + 6);
    EXPECT_EQ(radius_after(larger), larger);
    EXPECT_TRUE(ends_at_border(radius_after(0), 8));
    EXPECT_TRUE(ends_at_border(radius_after(dense_radius(8)), 8));
}

TEST(BorderRadii, NeitherThreadsNorTheOrderOfFacesChangeThem) {
    BuildOptions threads;
    threads.threads = 3;
    const Surface surface = strips(1, 0, 0.3, kStripWidth, 400);
    EXPECT_EQ(file_of(built(shuffled(surface, 5), threads)), file_of(built(surface, {})));
}

} // namespace
