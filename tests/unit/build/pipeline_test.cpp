#include "pbm_build/voxels/hit_store.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <set>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::built;
using test::file_of;
using test::refused;

// The cube [low, high]^3: two triangles per face, counter-clockwise seen from outside.
Surface cube(double low, double high) {
    Surface surface;
    for (unsigned i = 0; i < 8; ++i)
        surface.positions.emplace_back((i & 1) != 0 ? high : low, (i & 2) != 0 ? high : low, (i & 4) != 0 ? high : low);
    surface.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                         {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return surface;
}

// A bumpy sphere with colours and materials, `rings` x 2 `rings` quads.
Surface bumpy_sphere(unsigned rings) {
    Surface surface;
    const double pi = std::acos(-1.0);
    for (unsigned i = 0; i <= rings; ++i)
        for (unsigned j = 0; j < 2 * rings; ++j) {
            const double polar = pi * i / rings, around = pi * j / rings;
            const double radius = 1 + 0.1 * std::pow(std::sin(polar), 3) * std::sin(7 * polar) * std::cos(5 * around);
            surface.positions.emplace_back(radius * std::sin(polar) * std::cos(around), radius * std::cos(polar),
                                           radius * std::sin(polar) * std::sin(around));
            surface.colours.push_back({static_cast<std::uint8_t>(i * 7), static_cast<std::uint8_t>(j * 3), 90});
            surface.material_ids.push_back(static_cast<std::uint8_t>((i + j) % 3));
        }
    surface.materials.resize(3);
    for (unsigned i = 0; i < rings; ++i)
        for (unsigned j = 0; j < 2 * rings; ++j) {
            const unsigned a = i * 2 * rings + j, b = i * 2 * rings + (j + 1) % (2 * rings);
            surface.triangles.emplace_back(a, b, b + 2 * rings);
            surface.triangles.emplace_back(a, b + 2 * rings, a + 2 * rings);
        }
    return surface;
}

Surface as_points(Surface surface) {
    surface.triangles.clear();
    for (const glm::dvec3 &p : surface.positions)
        surface.normals.emplace_back(p);
    return surface;
}

// The same geometry with vertices, triangles and corners in another order.
Surface shuffled(const Surface &surface, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<unsigned> old_index(surface.positions.size()), new_index(surface.positions.size());
    std::iota(old_index.begin(), old_index.end(), 0U);
    std::shuffle(old_index.begin(), old_index.end(), random);
    Surface other = surface;
    const auto permute = [&](const auto &from, auto &to) {
        for (std::size_t i = 0; i < from.size(); ++i)
            to[i] = from[old_index[i]];
    };
    permute(surface.positions, other.positions);
    permute(surface.normals, other.normals);
    permute(surface.colours, other.colours);
    permute(surface.material_ids, other.material_ids);
    for (unsigned i = 0; i < old_index.size(); ++i)
        new_index[old_index[i]] = i;
    std::shuffle(other.triangles.begin(), other.triangles.end(), random);
    for (glm::uvec3 &t : other.triangles) {
        const auto turn = static_cast<int>(random() % 3);
        t = {new_index[t[turn]], new_index[t[(turn + 1) % 3]], new_index[t[(turn + 2) % 3]]};
    }
    return other;
}

BuildOptions at_depth(int depth, int threads = 2) {
    BuildOptions options;
    options.grid.depth = depth;
    options.grid.up = UpAxis::y; // so that the report has no line of it
    options.threads = threads;
    return options;
}

std::vector<std::array<std::uint32_t, 3>> voxels_of(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.levels[level].points.size()));
    std::vector<std::array<std::uint32_t, 3>> voxels;
    voxels.reserve(codes.size());
    for (const MortonCode code : codes)
        voxels.push_back(morton_decode(code));
    return voxels;
}

TEST(Pipeline, ACubeOfTwelveTrianglesIsClosed) {
    constexpr int kSide = 64, kPadded = kSide + 2;
    const auto voxels = voxels_of(built(cube(-1, 1), at_depth(6)));
    std::vector<char> state(kPadded * kPadded * kPadded, 0); // 1 wall, 2 reached from outside
    const auto at = [&](int x, int y, int z) -> char & {
        return state[(static_cast<std::size_t>(z) * kPadded + static_cast<std::size_t>(y)) * kPadded +
                     static_cast<std::size_t>(x)];
    };
    for (const auto &v : voxels)
        at(static_cast<int>(v[0]) + 1, static_cast<int>(v[1]) + 1, static_cast<int>(v[2]) + 1) = 1;
    std::vector<std::array<int, 3>> open{{0, 0, 0}};
    at(0, 0, 0) = 2;
    while (!open.empty()) {
        const auto [x, y, z] = open.back();
        open.pop_back();
        for (const auto &[dx, dy, dz] :
             {std::array{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
            const int u = x + dx, v = y + dy, w = z + dz;
            if (std::min({u, v, w}) < 0 || std::max({u, v, w}) >= kPadded || at(u, v, w) != 0)
                continue;
            at(u, v, w) = 2;
            open.push_back({u, v, w});
        }
    }
    EXPECT_EQ(at(33, 33, 33), 0) << "the outside leaks in";
    EXPECT_EQ(voxels.size(), 6U * 64 * 64 - 12 * 64 + 8) << "the walls are one voxel thick";
}

TEST(Pipeline, FacesOfACubeAreShadedFlat) {
    const Model model = built(cube(-1, 1), at_depth(6));
    const auto voxels = voxels_of(model);
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        int walls = 0;
        std::array<double, 3> outward{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (voxels[i][axis] == 0 || voxels[i][axis] == 63) {
                ++walls;
                outward[axis] = voxels[i][axis] == 0 ? -1 : 1;
            }
        if (walls == 1) {
            ASSERT_EQ(model.levels.back().points.normals[i], quantise_normal(outward[0], outward[1], outward[2]));
        }
    }
}

TEST(Pipeline, AFaceAtAVoxelBoundaryMakesOneLayer) {
    Surface wall; // in the plane z = 0; the triangle far above centres the grid on that plane
    wall.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 1}, {0, 0, -1}};
    wall.triangles = {{0, 1, 2}, {0, 2, 3}};
    const auto voxels = voxels_of(built(wall, at_depth(5)));
    EXPECT_EQ(voxels.size(), 32U * 32);
}

TEST(Pipeline, TheOrderOfAMeshDoesNotChangeAByte) {
    const Surface surface = bumpy_sphere(40);
    const Bytes file = file_of(built(surface, at_depth(7, 1)));
    for (unsigned seed = 1; seed <= 3; ++seed)
        EXPECT_EQ(file_of(built(shuffled(surface, seed), at_depth(7, static_cast<int>(seed)))), file);
}

TEST(Pipeline, TheOrderOfPointsDoesNotChangeAByte) {
    const Surface surface = as_points(bumpy_sphere(60));
    BuildOptions options;
    const Bytes file = file_of(built(surface, options));
    for (unsigned seed = 1; seed <= 3; ++seed) {
        options.threads = static_cast<int>(seed);
        EXPECT_EQ(file_of(built(shuffled(surface, seed), options)), file);
    }
}

TEST(Pipeline, AThinWallInsideOneVoxelIsTwoSided) {
    Surface wall = cube(0, 1);
    for (glm::dvec3 &p : wall.positions)
        p.z = 0.51 + p.z * 1e-4; // a plate much thinner than a voxel
    BuildOptions options;
    options.grid.voxel_size = 1.0 / 32;
    const Model model = built(wall, options);
    const auto voxels = voxels_of(model);
    std::size_t two_sided = 0;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        const std::uint16_t normal = model.levels.back().points.normals[i];
        const auto [x, y, z] = voxels[i];
        const double left = model.parameters.grid.origin[0] * 32 + x, front = model.parameters.grid.origin[1] * 32 + y;
        if (std::min(left, front) < 1 || std::max(left, front) > 30)
            continue; // the rim
        EXPECT_NE(normal & kTwoSidedBit, 0);
        EXPECT_GT(std::fabs(normal_table()[normal & kNormalIndexMask][2]), 0.99);
        ++two_sided;
    }
    EXPECT_EQ(two_sided, 30U * 30);
}

TEST(Pipeline, CoordinatesOfUtmSizeKeepTheirPrecision) {
    const Surface here = cube(-1, 1);
    Surface far = here;
    for (glm::dvec3 &p : far.positions)
        p += glm::dvec3(524288.0, 4194304.0, 64.0);
    const Model near_model = built(here, at_depth(8)), far_model = built(far, at_depth(8));
    EXPECT_EQ(voxels_of(near_model), voxels_of(far_model));
    EXPECT_NEAR(far_model.parameters.grid.origin[1], 4194304.0 - 1, 1e-5);
}

TEST(Pipeline, HugeAndTinyModelsAreTheSameModel) {
    const auto expected = voxels_of(built(cube(-1, 1), at_depth(6)));
    for (const double scale : {1e-25, 1e25})
        EXPECT_EQ(voxels_of(built(cube(-scale, scale), at_depth(6))), expected);
    EXPECT_EQ(refused(cube(-1e31, 1e31)).code, ErrorCode::too_large);
    EXPECT_EQ(refused(cube(-1e-31, 1e-31)).code, ErrorCode::too_large);
}

TEST(Pipeline, DegenerateSurfacesBuild) {
    Surface point;
    point.positions = {{3, 4, 5}};
    point.normals = {{0, 0, 2}};
    EXPECT_EQ(built(point, {}).point_count(), 1U);

    Surface same = point;
    same.positions.assign(5, {3, 4, 5});
    same.normals.assign(5, {0, 1, 0});
    EXPECT_EQ(built(same, {}).point_count(), 1U);

    Surface triangle;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    EXPECT_GT(built(triangle, at_depth(4)).point_count(), 16U * 16 / 2);

    Surface line = triangle; // no area, no normal
    line.positions[2] = {2, 0, 0};
    EXPECT_EQ(built(line, at_depth(4)).point_count(), 16U);

    Surface dot = triangle;
    dot.positions = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    EXPECT_EQ(built(dot, {}).point_count(), 1U);
}

Surface without_normals(Surface points) {
    points.normals.clear();
    return points;
}

TEST(Pipeline, TheOrderOfPointsWithoutNormalsDoesNotChangeAByte) {
    Surface surface = without_normals(as_points(bumpy_sphere(60)));
    surface.positions.insert(surface.positions.end(), surface.positions.begin(), surface.positions.begin() + 1000);
    surface.colours.insert(surface.colours.end(), surface.colours.begin(), surface.colours.begin() + 1000);
    surface.material_ids.resize(surface.positions.size(), 1);
    surface.positions.back() = {5, 5, 5}; // astray
    for (const Outliers outliers : {Outliers::drop_strays, Outliers::drop}) {
        BuildOptions options;
        options.outliers = outliers;
        options.threads = 2;
        const Bytes file = file_of(built(surface, options));
        unsigned seed = 1;
        for (const int threads : {1, 8}) {
            options.threads = threads;
            EXPECT_EQ(file_of(built(shuffled(surface, seed++), options)), file);
        }
    }
}

TEST(Pipeline, CopiesOfPointsDoNotChangeTheirNormals) {
    const Surface once = without_normals(as_points(bumpy_sphere(60)));
    Surface thrice = once;
    for (int i = 0; i < 2; ++i) {
        thrice.positions.insert(thrice.positions.end(), once.positions.begin(), once.positions.end());
        thrice.colours.insert(thrice.colours.end(), once.colours.begin(), once.colours.end());
        thrice.material_ids.insert(thrice.material_ids.end(), once.material_ids.begin(), once.material_ids.end());
    }
    EXPECT_EQ(file_of(built(thrice, {})), file_of(built(once, {})));
}

TEST(Pipeline, StrictTakesPointsWithoutNormals) {
    BuildOptions options;
    options.grid.up = UpAxis::y;
    options.strict = true;
    BuildStatistics statistics;
    const Result<Model> model = build_model(without_normals(as_points(bumpy_sphere(60))), options, statistics);
    ASSERT_TRUE(model.ok());
    ASSERT_EQ(statistics.attributes.size(), 2U);
    EXPECT_EQ(statistics.attributes[0].name, "shape"); // a few at the poles, where the rings are narrow
    EXPECT_EQ(statistics.attributes[1].name, "normals");
    EXPECT_EQ(statistics.attributes[1].fate, AttributeReport::Fate::estimated);
    EXPECT_LT(statistics.two_sided_points, model->point_count() / 100);
}

// 200 points within a cube of edge 1, and strays: each hides the nearer ones.
Surface points_with_strays(const std::vector<double> &strays) {
    Surface surface;
    for (int i = 0; i < 200; ++i)
        surface.positions.emplace_back(std::fmod(i * 0.618034, 1), std::fmod(i * 0.414214, 1),
                                       std::fmod(i * 0.732051, 1));
    for (const double stray : strays)
        surface.positions.emplace_back(stray, stray, stray);
    return surface;
}

TEST(Pipeline, StraysThatWouldMakeTheModelADotAreDroppedAndNamed) {
    const Model bulk = built(points_with_strays({}), {});
    for (const std::vector<double> &strays : {std::vector<double>{1e9}, {1e9, 1e4}, {-1e25, 1e12, 40}}) {
        BuildStatistics statistics;
        BuildOptions options;
        options.grid.up = UpAxis::y;
        const Result<Model> model = build_model({points_with_strays(strays)}, options, statistics);
        ASSERT_TRUE(model.ok());
        EXPECT_EQ(model->levels, bulk.levels) << strays.size();
        ASSERT_FALSE(statistics.attributes.empty());
        EXPECT_EQ(statistics.attributes.front().name, "outliers");
        EXPECT_EQ(statistics.attributes.front().fate, AttributeReport::Fate::dropped);
        EXPECT_NE(statistics.attributes.front().note.find("--keep-outliers keeps them"), std::string::npos);

        BuildOptions strict;
        strict.strict = true;
        BuildStatistics refused;
        const Result<Model> none = build_model({points_with_strays(strays)}, strict, refused);
        ASSERT_FALSE(none.ok());
        EXPECT_EQ(none.error().code, ErrorCode::bad_input);
        EXPECT_NE(none.error().message.find(" far from all others"), std::string::npos);
    }
}

TEST(Pipeline, StraysStayWhereTheyAreWantedOrDoNoHarm) {
    const auto extent = [](const std::vector<double> &strays, const BuildOptions &options) {
        return built(points_with_strays(strays), options).parameters.grid.edge();
    };
    BuildOptions keep;
    keep.outliers = Outliers::keep;
    EXPECT_GT(extent({1e9}, keep), 1e9);
    EXPECT_GT(extent({8}, {}), 7); // the grid is 8 times larger
    BuildOptions given;
    given.grid.voxel_size = 0.5;
    EXPECT_GT(extent({100}, given), 100);
    // More than one point in twenty: an object.
    EXPECT_GT(extent({100, 100.5, 101, 101.5, 102, 102.5, 103, 103.5, 104, 104.5, 105, 105.5}, {}), 100);
}

TEST(Pipeline, OutliersAreCountedAndStaySmallOrAreDroppedBeforeTheGridIsChosen) {
    Surface surface = without_normals(as_points(bumpy_sphere(60)));
    const double edge = built(surface, {}).parameters.grid.edge();
    surface.positions.emplace_back(4, 4, 4);
    surface.colours.push_back({1, 2, 3});
    surface.material_ids.push_back(0);
    BuildOptions options;
    options.grid.up = UpAxis::y;
    BuildStatistics statistics;
    const Result<Model> kept = build_model(surface, options, statistics);
    ASSERT_TRUE(kept.ok());
    EXPECT_EQ(statistics.attributes.front().name, "outliers");
    EXPECT_EQ(statistics.attributes.front().note.rfind("1 point far from all others", 0), 0U);
    EXPECT_EQ(statistics.attributes.front().fate, AttributeReport::Fate::kept);
    Bytes radii = value_of(kept).levels.back().points.radii; // the outlier is the last voxel
    const std::uint8_t of_outlier = radii.back();
    std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
    EXPECT_LE(of_outlier, radii[radii.size() / 2] + 12) << "more than twice the median";

    options.outliers = Outliers::drop;
    BuildStatistics dropped;
    const Result<Model> model = build_model(surface, options, dropped);
    ASSERT_TRUE(model.ok());
    EXPECT_EQ(dropped.attributes.front().fate, AttributeReport::Fate::dropped);
    EXPECT_EQ(value_of(model).parameters.grid.edge(), edge);
    EXPECT_NE(value_of(model).metadata.find("\"remove_outliers\":true"), std::string::npos);
}

TEST(Pipeline, PointsOfUtmSizeKeepTheirPrecision) {
    Surface here = without_normals(as_points(bumpy_sphere(60)));
    std::mt19937 random(1);
    for (glm::dvec3 &p : here.positions) // multiples of 2^-20: the shift is exact
        for (int axis = 0; axis < 3; ++axis) {
            const int stir = static_cast<int>(random() % 4096); // avoids equal distances, where rounding would decide
            p[axis] = (std::nearbyint(p[axis] * 0x1p20) + stir) * 0x1p-20;
        }
    Surface far = here;
    for (glm::dvec3 &p : far.positions)
        p += glm::dvec3(500000.0, 8.5e6, 1234.0);
    const Model near_model = built(here, {}), far_model = built(far, {});
    EXPECT_EQ(voxels_of(near_model), voxels_of(far_model));
    EXPECT_EQ(near_model.levels.back().points.normals, far_model.levels.back().points.normals);
}

TEST(Pipeline, AScanTooSmallForItsPlaceIsReported) {
    Surface far = cube(0, 0.001);
    for (glm::dvec3 &p : far.positions)
        p += 8.5e6;
    BuildStatistics statistics;
    ASSERT_TRUE(build_model(far, at_depth(8), statistics).ok());
    ASSERT_EQ(statistics.attributes.size(), 1U);
    EXPECT_EQ(statistics.attributes[0].name, "precision");
    BuildStatistics silent;
    ASSERT_TRUE(build_model(cube(0, 0.001), at_depth(8), silent).ok());
    EXPECT_TRUE(silent.attributes.empty());
}

// A point set that determines no surface gives a model of two-sided points.
TEST(Pipeline, DegeneratePointSetsBuild) {
    const auto points = [](std::vector<glm::dvec3> positions) {
        Surface surface;
        surface.positions = std::move(positions);
        return surface;
    };
    std::vector<glm::dvec3> line;
    line.reserve(100);
    for (int i = 0; i < 100; ++i)
        line.push_back(glm::dvec3(1, 2, 3) * 0.1 * static_cast<double>(i));
    const struct {
        Surface surface;
        std::size_t least, most;
    } cases[] = {
        {points({{1, 2, 3}}), 1, 1},
        {points({{0, 0, 0}, {1, 0, 0}}), 2, 2},
        {points(std::vector<glm::dvec3>(1000000, {7, 8, 9})), 1, 1},
        {points({{-5e29, 0, 0}, {5e29, 0, 0}}), 2, 2},
        {points(line), 50, 100},
    };
    for (const auto &[surface, least, most] : cases) {
        const Model model = built(surface, {});
        EXPECT_GE(model.point_count(), least);
        EXPECT_LE(model.point_count(), most);
        for (const std::uint16_t normal : model.levels.back().points.normals)
            EXPECT_NE(normal & kTwoSidedBit, 0);
        EXPECT_GT(file_of(model).size(), 0U);
    }
}

TEST(Pipeline, PlanesOfPointsHaveTheNormalOfThePlane) {
    for (const glm::dvec3 &n : {glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 0), glm::dvec3(1, 0, 0), glm::dvec3(2, 3, 6)}) {
        const glm::dvec3 u = n.x == 0 ? glm::dvec3(1, 0, 0) : glm::dvec3(-n.y, n.x, 0) / std::hypot(n.x, n.y);
        const glm::dvec3 v = glm::dvec3(n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x) /
                             std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
        Surface plane;
        for (int y = 0; y < 30; ++y)
            for (int x = 0; x < 30; ++x)
                plane.positions.push_back(static_cast<double>(x) * u + static_cast<double>(y) * v);
        const Model model = built(plane, {});
        EXPECT_GT(model.point_count(), 500U);
        for (const std::uint16_t normal : model.levels.back().points.normals) {
            const UnitVector &found = normal_table()[normal & kNormalIndexMask];
            const double cosine =
                (found[0] * n.x + found[1] * n.y + found[2] * n.z) / std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
            ASSERT_GT(n == glm::dvec3(1, 0, 0) ? std::fabs(cosine) : cosine, 0.999);
            ASSERT_EQ((normal & kTwoSidedBit) != 0, n == glm::dvec3(1, 0, 0)) << "nothing says where X planes face";
        }
    }
}

// A neighbour search that visits all points of the same lattice point would be quadratic.
TEST(Pipeline, AScanThatAStrayPointShrinksToNothingBuildsInTime) {
    Surface surface;
    std::mt19937 bits(3);
    const auto random = [&] { return static_cast<double>(bits()) * 0x1p-32; };
    for (int i = 0; i < 300000; ++i)
        surface.positions.emplace_back(random(), random(), random());
    surface.positions.emplace_back(1e30, 0, 0);
    BuildOptions options;
    options.outliers = Outliers::keep;
    EXPECT_EQ(built(surface, options).point_count(), 2U);
    for (const Outliers outliers : {Outliers::drop_strays, Outliers::drop}) {
        options.outliers = outliers;
        EXPECT_GT(built(surface, options).point_count(), 1000U);
    }
}

TEST(Pipeline, NormalsOfNoLengthTakeTheirNeighboursMean) {
    Surface plane;
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 20; ++x) {
            plane.positions.emplace_back(x, y, 0);
            plane.normals.emplace_back(0, 0, x == 10 && y == 10 ? 0 : 5);
        }
    const Model model = built(plane, at_depth(6));
    EXPECT_EQ(model.point_count(), 400U);
    for (const std::uint16_t normal : model.levels.back().points.normals)
        EXPECT_EQ(normal, quantise_normal(0, 0, 1));
}

TEST(Pipeline, GivenNormalsAreKeptWhereTheyDisagreeWithTheWinding) {
    Surface inverted = bumpy_sphere(40);
    inverted.normals.clear();
    for (const glm::dvec3 &p : inverted.positions)
        inverted.normals.emplace_back(p);
    for (glm::uvec3 &t : inverted.triangles)
        std::swap(t.y, t.z);
    const Model model = built(inverted, at_depth(6));
    const auto voxels = voxels_of(model);
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        const UnitVector &n = normal_table()[model.levels.back().points.normals[i] & kNormalIndexMask];
        double outward = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            outward += n[axis] * (voxels[i][axis] - 31.5);
        ASSERT_GT(outward, 0);
    }
}

TEST(Pipeline, MaxPointsIsTheFinestDepthThatFits) {
    const Surface surface = bumpy_sphere(30);
    const std::uint64_t at_6 = built(surface, at_depth(6)).point_count(),
                        at_7 = built(surface, at_depth(7)).point_count();
    BuildOptions options;
    for (const std::uint64_t most : {at_6, at_7 - 1}) {
        options.grid.max_points = most;
        const Model model = built(surface, options);
        EXPECT_EQ(model.parameters.grid.depth, 6);
        EXPECT_EQ(model.point_count(), at_6);
    }
    options.grid.max_points = 3;
    EXPECT_EQ(refused(surface, options).code, ErrorCode::usage);
}

TEST(Pipeline, ADepthThatNeedsTooMuchMemoryIsRefusedAtOnce) {
    BuildOptions options = at_depth(16);
    EXPECT_EQ(refused(cube(0, 1), options).code, ErrorCode::memory);
}

TEST(Pipeline, ADepthThatNobodyAskedForFitsIntoMemory) {
    BuildOptions options;
    const Surface surface = bumpy_sphere(30);
    BuildStatistics statistics;
    ASSERT_TRUE(build_model(surface, options, statistics).ok());
    const int wished = statistics.depth;
    options.max_samples = statistics.samples - 1;
    statistics = {};
    const Result<Model> model = build_model(surface, options, statistics);
    ASSERT_TRUE(model.ok()) << model.error().message;
    EXPECT_LT(model->parameters.grid.depth, wished);
    const auto said = [](const AttributeReport &line) { return warning_of(line) == Warning::coarser_grid; };
    EXPECT_EQ(std::count_if(statistics.attributes.begin(), statistics.attributes.end(), said), 1);
    options.denied.set(static_cast<std::size_t>(Warning::coarser_grid));
    EXPECT_EQ(refused(surface, options).code, ErrorCode::bad_input);
    options.denied.reset();
    options.grid.depth = wished;
    EXPECT_EQ(refused(surface, options).code, ErrorCode::memory);
}

TEST(Pipeline, OptionsThatChangeNothingAreNamed) {
    BuildOptions options = at_depth(5);
    options.viewpoints = {{0, 0, 5}};
    options.outliers = Outliers::drop;
    BuildStatistics statistics;
    ASSERT_TRUE(build_model(cube(0, 1), options, statistics).ok());
    const auto dropped = [&](std::string_view name) {
        return std::any_of(statistics.attributes.begin(), statistics.attributes.end(), [&](const auto &line) {
            return line.name == name && line.fate == AttributeReport::Fate::dropped;
        });
    };
    EXPECT_TRUE(dropped("--viewpoint"));
    EXPECT_TRUE(dropped("--remove-outliers"));
    EXPECT_FALSE(dropped("--flip-faces"));
}

TEST(Pipeline, ColoursAndMaterialsArriveInThePoints) {
    Surface surface = cube(-1, 1);
    surface.colours.assign(8, {200, 100, 50});
    surface.material_ids.assign(8, 1);
    surface.materials.resize(2);
    BuildOptions options = at_depth(5);
    options.colour = ColourFormat::rgb565;
    const Model model = built(surface, options);
    for (std::size_t i = 0; i < model.point_count(); ++i) {
        EXPECT_EQ(point_colour(model.levels.back().points.colours, i, ColourFormat::rgb565),
                  expand_565(pack_565({200, 100, 50})));
        EXPECT_EQ(model.levels.back().points.materials[i], 1);
    }
    surface.materials.resize(kMaxMaterials + 1);
    EXPECT_EQ(refused(surface, options).code, ErrorCode::unsupported_feature);
}

TEST(Pipeline, TheUpAxisIsFoundAndReportedUnlessItIsGiven) {
    Surface pyramid = cube(-1, 1);
    for (glm::dvec3 &p : pyramid.positions)
        if (p.z > 0)
            p = {p.x / 10, p.y / 10, 1};
    const auto built_with = [&](const BuildOptions &options) {
        BuildStatistics statistics;
        const Model model = value_of(build_model(pyramid, options, statistics));
        const bool is_reported =
            std::ranges::any_of(statistics.attributes, [](const auto &line) { return line.name == "up axis"; });
        EXPECT_EQ(is_reported, !options.grid.up && !options.grid.like);
        return model.parameters.grid;
    };
    BuildOptions options;
    const Grid found = built_with(options);
    EXPECT_EQ(found.up, UpAxis::z);
    options.grid.up = UpAxis::x;
    EXPECT_EQ(built_with(options).up, UpAxis::x);
    options.grid = {};
    options.grid.like = found;
    options.grid.like->up = UpAxis::y;
    EXPECT_EQ(built_with(options).up, UpAxis::y);
}

TEST(Pipeline, LooseVerticesAreReportedAndRefusedIfStrict) {
    Surface surface = cube(-1, 1);
    surface.positions.emplace_back(100, 100, 100);
    BuildStatistics statistics;
    const Result<Model> model = build_model(surface, at_depth(5), statistics);
    ASSERT_TRUE(model.ok());
    EXPECT_LT(value_of(model).parameters.grid.edge(), 2.1);
    ASSERT_EQ(statistics.attributes.size(), 1U);
    EXPECT_EQ(statistics.attributes[0].fate, AttributeReport::Fate::dropped);
    BuildOptions strict = at_depth(5);
    strict.strict = true;
    EXPECT_EQ(refused(surface, strict).code, ErrorCode::bad_input);
}

TEST(Pipeline, MetadataSaysWhatWasAskedAndNothingAboutTheMachine) {
    BuildOptions options = at_depth(5);
    options.credits = {"A cube", "CC0", "Nobody"};
    const std::string metadata = built(cube(0, 1), options).metadata;
    for (const char *part : {"\"generator\":\"pbm-build ", "\"name\":\"A cube\"", "\"licence\":\"CC0\"", "\"depth\":5"})
        EXPECT_NE(metadata.find(part), std::string::npos) << part;
    options.credits.name = "\xff";
    EXPECT_EQ(refused(cube(0, 1), options).code, ErrorCode::usage);
    options.credits.name = std::string(5000, 'x');
    EXPECT_EQ(refused(cube(0, 1), options).code, ErrorCode::usage);
}

TEST(Pipeline, MetadataHasTheViewsAndPartsOfTheScanAsFarAsThereIsRoom) {
    Surface surface = cube(0, 1);
    surface.views = {{.name = "front", .position = {0.5, 0.5, 3}, .focal_point = {0.5, 0.5, 0.1}, .view_angle = 0.5}};
    surface.part_names = {"lid", "body"};
    BuildOptions options = at_depth(5);
    options.placement = {.scale = 2, .origin = std::array<double, 3>{10, 0, 0}};
    std::vector<Surface> placed{surface};
    place(placed[0], options.placement);
    const std::string metadata = built(placed, options).metadata;
    EXPECT_NE(metadata.find(R"("views":[{"name":"front","position":[11.0,1.0,6.0],"focal_point":[11.0,1.0,0.2],)"
                            R"("up":[0.0,1.0,0.0],"angle":28.6478897565}],"parts":["lid","body"]})"),
              std::string::npos)
        << metadata;
    surface.views.resize(100, surface.views[0]);
    BuildStatistics said;
    const std::string full = built(surface, options, &said).metadata;
    EXPECT_LE(full.size(), 4096U - 256 - 384);
    EXPECT_GT(full.size(), 3200U);
    EXPECT_TRUE(std::any_of(said.attributes.begin(), said.attributes.end(), [](const AttributeReport &line) {
        return line.name == "further cameras" && line.fate == Fate::dropped;
    }));
}

} // namespace
