// Several inputs: merged, scaled, shifted, and voxelized on the grid of another file.
#include "pbm_build/surface/merge_surfaces.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

namespace {

using namespace pbm;
using namespace pbm::build;
using pbm::test::at_depth;
using pbm::test::built;
using pbm::test::file_of;
using pbm::test::refused;

// Corners of a cube of edge 2 around `centre`; faces point outside.
Surface cube(glm::dvec3 centre) {
    Surface surface;
    for (unsigned i = 0; i < 8; ++i)
        surface.positions.push_back(centre +
                                    glm::dvec3((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1));
    surface.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                         {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return surface;
}

// Points of a sphere of radius 1 around `centre`, with normals.
Surface cloud(glm::dvec3 centre, unsigned count = 2000) {
    Surface surface;
    for (unsigned i = 0; i < count; ++i) {
        const double z = 1 - (2.0 * i + 1) / count, around = 2.399963229728653 * i, r = std::sqrt(1 - z * z);
        const glm::dvec3 n(r * std::cos(around), r * std::sin(around), z);
        surface.positions.push_back(centre + n);
        surface.normals.emplace_back(n);
    }
    return surface;
}

// Index of the point whose voxel holds `place`, or the number of points.
std::size_t point_at(const Model &model, glm::dvec3 place) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.levels[level].points.size()));
    const Grid &grid = model.parameters.grid;
    std::array<std::uint32_t, 3> voxel{};
    for (int axis = 0; axis < 3; ++axis)
        voxel[static_cast<std::size_t>(axis)] =
            static_cast<std::uint32_t>((place[axis] - grid.origin[static_cast<std::size_t>(axis)]) / grid.voxel_size);
    const auto found = std::lower_bound(codes.begin(), codes.end(), morton_encode(voxel[0], voxel[1], voxel[2]));
    EXPECT_TRUE(found != codes.end() && *found == morton_encode(voxel[0], voxel[1], voxel[2]));
    return static_cast<std::size_t>(found - codes.begin());
}

// Sum of the normals of all points, along an axis.
double sum_of_normals(const Model &model, std::size_t axis) {
    double sum = 0;
    for (const std::uint16_t normal : model.levels.back().points.normals)
        sum += normal_table()[normal & kNormalIndexMask][axis];
    return sum;
}

Surface named(Surface surface, std::string name) {
    surface.name = std::move(name);
    return surface;
}

std::vector<std::string> lines_of(const BuildStatistics &statistics) {
    std::vector<std::string> lines;
    for (const AttributeReport &line : statistics.attributes)
        if (line.name != "up axis")
            lines.push_back(line.input + ": " + line.name);
    return lines;
}

TEST(Merge, OneSurfaceStaysAsItIs) {
    Surface surface = cube({0, 0, 0});
    surface.materials.resize(2);
    surface.material_ids.assign(8, 1);
    const Result<Surface> merged = merge_surfaces({surface}, 1);
    ASSERT_TRUE(merged.ok());
    EXPECT_EQ(merged->positions, surface.positions);
    EXPECT_EQ(merged->materials.size(), 2U);
    EXPECT_EQ(merged->material_ids, surface.material_ids);
}

TEST(Merge, TheOrderOfTheInputsDoesNotChangeTheBytes) {
    std::vector<Surface> surfaces{cube({0, 0, 0}), cloud({3, 0, 0}), cube({0, 3, 0}), cloud({0, 0, 3})};
    surfaces[0].materials.push_back({.ks = 0.9F});
    surfaces[1].radii.assign(2000, 0.07F);
    surfaces[2].colours.assign(8, {200, 10, 20});
    surfaces[2].normals.assign(8, {0, 1, 0});
    surfaces[3].materials = {{.ks = 0.25F, .colour = {9, 90, 200}}, {}};
    surfaces[3].material_ids.assign(2000, 0);
    surfaces[3].two_sided.assign(2000, 1);
    for (const bool by_itself : {true, false}) {
        BuildOptions options = at_depth(7);
        if (by_itself)
            options.grid.depth = std::nullopt;
        const Bytes file = file_of(built(surfaces, options));
        std::vector<std::size_t> order{0, 1, 2, 3};
        while (std::next_permutation(order.begin(), order.end())) {
            std::vector<Surface> other;
            other.reserve(order.size());
            for (const std::size_t i : order)
                other.push_back(surfaces[i]);
            ASSERT_EQ(file_of(built(std::move(other), options)), file);
        }
    }
}

// The points of `cloud` without normals, seen from `station`.
Surface scanned(glm::dvec3 centre, glm::dvec3 station) {
    Surface surface = cloud(centre);
    surface.normals.clear();
    surface.stations = {station};
    surface.station_ids.assign(surface.positions.size(), 0);
    return surface;
}

TEST(Merge, StationsAreNumberedAnew) {
    const Surface first = scanned({0, 0, 0}, {1, 2, 3}), second = scanned({4, 0, 0}, {7, 8, 9});
    Surface third = second;
    third.stations = {{0, 0, 0}, {0, 0, 1}};
    third.station_ids[1] = 1;
    third.station_ids[2] = kNoStation;
    const Result<Surface> merged = merge_surfaces({first, cloud({8, 0, 0}), second, third}, 1);
    ASSERT_TRUE(merged.ok());
    EXPECT_EQ(merged->stations, (std::vector<glm::dvec3>{{1, 2, 3}, {7, 8, 9}, {0, 0, 0}, {0, 0, 1}}));
    ASSERT_EQ(merged->station_ids.size(), merged->positions.size());
    EXPECT_EQ(merged->station_ids[0], 0);
    EXPECT_EQ(merged->station_ids[2000], kNoStation);
    EXPECT_EQ(merged->station_ids[4000], 1);
    EXPECT_EQ(merged->station_ids[6000], 2);
    EXPECT_EQ(merged->station_ids[6001], 3);
    EXPECT_EQ(merged->station_ids[6002], kNoStation);
}

TEST(Merge, MoreStationsThanHaveNumbersAreDropped) {
    Surface first = scanned({0, 0, 0}, {0, 0, 0});
    first.stations.resize(kNoStation, {0, 0, 0});
    const Result<Surface> merged = merge_surfaces({first, scanned({4, 0, 0}, {0, 0, 0})}, 1);
    ASSERT_TRUE(merged.ok());
    EXPECT_TRUE(merged->stations.empty() && merged->station_ids.empty());
    EXPECT_EQ(merged->report.back().name, "scanner positions");
    EXPECT_EQ(merged->report.back().fate, Fate::dropped);
}

TEST(Merge, StationsOrientPointsWhateverTheOrderOfTheInputs) {
    const Surface inside = scanned({0, 0, 0}, {0, 0, 0}), outside = scanned({0, 0, 4}, {0, 0, -50});
    BuildStatistics said;
    const Model model = built({inside, outside}, at_depth(7), &said);
    const std::uint16_t top = model.levels.back().points.normals[point_at(model, inside.positions[0])];
    EXPECT_LT(normal_table()[top & kNormalIndexMask][2], -0.9F) << "the inside of the sphere";
    EXPECT_EQ(file_of(model), file_of(built({outside, inside}, at_depth(7))));
    EXPECT_TRUE(std::any_of(said.attributes.begin(), said.attributes.end(), [](const AttributeReport &line) {
        return line.name == "normals" && line.note.ends_with("turned to 2 scanner positions");
    }));
}

TEST(Merge, EachInputHasItsViewpoint) {
    Surface inside = scanned({0, 0, 0}, {5, 5, 5}), outside = scanned({0, 0, 4}, {0, 0, 4});
    BuildOptions options = at_depth(7);
    options.viewpoints = {{0, 0, 0}, {0, 0, -50}};
    const Model model = built({inside, outside}, options);
    const auto top_of = [&](const Surface &surface) {
        const std::uint16_t top = model.levels.back().points.normals[point_at(model, surface.positions.front())];
        return normal_table()[top & kNormalIndexMask][2];
    };
    EXPECT_LT(top_of(inside), -0.9F);
    EXPECT_LT(top_of(outside), -0.9F) << "away from the viewpoint, which sees its other side";
}

TEST(Merge, PointsOfACloudStayBesideAMesh) {
    const Model both = built({cube({0, 0, 0}), cloud({4, 0, 0})}, at_depth(7));
    const Grid &grid = both.parameters.grid;
    BuildOptions same_grid;
    same_grid.grid.like = grid;
    const Model mesh = built({cube({0, 0, 0})}, same_grid), points = built({cloud({4, 0, 0})}, same_grid);
    EXPECT_EQ(both.point_count(), mesh.point_count() + points.point_count()) << "they share no voxel";

    // The other surface must not change a point.
    for (const Model *alone : {&mesh, &points}) {
        const glm::dvec3 place = alone == &mesh ? glm::dvec3(1, 0.3, 0.2) : cloud({4, 0, 0}).positions[700];
        const std::size_t here = point_at(both, place), there = point_at(*alone, place);
        EXPECT_EQ(both.levels.back().points.normals[here], alone->levels.back().points.normals[there]);
        EXPECT_EQ(both.levels.back().points.radii[here], alone->levels.back().points.radii[there]);
    }
}

TEST(Merge, PointsBesideTrianglesOfOneInputStayPoints) {
    Surface both = cube({0, 0, 0});
    const Surface points = cloud({4, 0, 0});
    both.normals.assign(8, {0, 0, 0});
    both.positions.insert(both.positions.end(), points.positions.begin(), points.positions.end());
    both.normals.insert(both.normals.end(), points.normals.begin(), points.normals.end());
    both.points_beside_triangles = points.positions.size();
    Surface apart = cube({0, 0, 0});
    const Surface other = cube({0, 4, 0});
    BuildStatistics said;
    EXPECT_EQ(file_of(built({both, other}, at_depth(7), &said)), file_of(built({apart, points, other}, at_depth(7))));
    EXPECT_EQ(lines_of(said), std::vector<std::string>{});
    EXPECT_EQ(built({both}, at_depth(7)).point_count(), built({apart, points}, at_depth(7)).point_count());
}

TEST(Merge, WhatOneInputLacksComesFromItsMaterial) {
    Surface red = cube({0, 0, 0}), plain = cube({4, 0, 0}), blue = cube({0, 4, 0});
    red.colours.assign(8, {255, 0, 0});
    blue.materials = {{}, {.colour = {1, 2, 250}}};
    blue.material_ids.assign(8, 1);
    BuildStatistics said;
    const Model model = built({named(red, "red"), named(plain, "plain"), named(blue, "blue")}, at_depth(7), &said);
    const PointAttributes &points = model.levels.back().points;
    const auto colour_at = [&](glm::dvec3 place) {
        return point_colour(points.colours, point_at(model, place), ColourFormat::rgb888);
    };
    EXPECT_EQ(colour_at({0, 0, 1}), (Rgb8{255, 0, 0}));
    EXPECT_EQ(colour_at({4, 0, 1}), (Rgb8{204, 204, 204})) << "of the default material";
    EXPECT_EQ(colour_at({0, 4, 1}), (Rgb8{1, 2, 250}));
    ASSERT_EQ(model.parameters.materials.size(), 2U) << "equal materials are one";
    EXPECT_EQ(model.parameters.materials[points.materials[point_at(model, {0, 4, 1})]].colour, (Rgb8{1, 2, 250}));
    EXPECT_EQ(model.parameters.materials[points.materials[point_at(model, {4, 0, 1})]], Material{});
    EXPECT_EQ(lines_of(said),
              (std::vector<std::string>{"red: materials", "plain: colours", "plain: materials", "blue: colours"}));
}

TEST(Merge, ColoursOfFacesStandBesideThoseOfVerticesAndMaterials) {
    Surface faces = cube({0, 0, 0}), red = cube({4, 0, 0}), some = cube({0, 4, 0});
    faces.face_colours.assign(12, {{0, 0, 250}, true});
    red.colours.assign(8, {255, 0, 0});
    some.face_colours.assign(12, {});
    for (std::size_t i = 0; i < 12; ++i) // those on top
        if (const glm::uvec3 &t = some.triangles[i];
            some.positions[t.x].z > 0 && some.positions[t.y].z > 0 && some.positions[t.z].z > 0)
            some.face_colours[i] = {{1, 200, 2}, true};
    const Model model = built({faces, red, some}, at_depth(7));
    const PointAttributes &points = model.levels.back().points;
    const auto colour_at = [&](glm::dvec3 place) {
        return point_colour(points.colours, point_at(model, place), ColourFormat::rgb888);
    };
    EXPECT_EQ(colour_at({0, 0, 1}), (Rgb8{0, 0, 250}));
    EXPECT_EQ(colour_at({4, 0, 1}), (Rgb8{255, 0, 0}));
    EXPECT_EQ(colour_at({0, 4, 1}), (Rgb8{1, 200, 2}));
    EXPECT_EQ(colour_at({0, 4, -1}), (Rgb8{204, 204, 204})) << "of the default material";
    EXPECT_EQ(built({some}, at_depth(6)).parameters.attributes.colour, ColourFormat::rgb888);
}

TEST(Merge, NormalsThatDisagreeWithTheirOwnFacesTurnThemOnly) {
    Surface inward = cube({0, 0, 0}); // faces wound inwards, normals that point outwards
    for (glm::uvec3 &t : inward.triangles)
        std::swap(t.y, t.z);
    for (const glm::dvec3 &p : inward.positions)
        inward.normals.emplace_back(p);
    const Surface right = cube({4, 0, 0}); // no normals: the winding decides
    const Model model = built({inward, right}, at_depth(6));
    const PointAttributes &points = model.levels.back().points;
    for (const glm::dvec3 centre : {glm::dvec3(0, 0, 0), glm::dvec3(4, 0, 0)}) {
        const std::uint16_t top = points.normals[point_at(model, centre + glm::dvec3(0, 0.999, 0))];
        EXPECT_GT(normal_table()[top & kNormalIndexMask][1], 0.9) << "around x = " << centre.x;
    }
    EXPECT_NEAR(sum_of_normals(model, 1) / static_cast<double>(model.point_count()), 0, 0.01);
}

TEST(Merge, MoreThanEightDifferentMaterialsAreRefused) {
    std::vector<Surface> surfaces;
    for (int i = 0; i < 9; ++i) {
        surfaces.push_back(cube({4.0 * i, 0, 0}));
        surfaces.back().materials.push_back({.ks = 0.1F * static_cast<float>(i)});
    }
    const Error error = refused(surfaces, at_depth(6));
    EXPECT_EQ(error.code, ErrorCode::unsupported_feature);
    EXPECT_EQ(error.message, "9 different materials in all, a .pbvg file holds 8; merge some of them");
    surfaces.pop_back();
    EXPECT_EQ(built(surfaces, at_depth(6)).parameters.materials.size(), 8U);
}

TEST(Merge, ErrorsNameTheInput) {
    Surface faceless = cloud({0, 0, 0});
    faceless.normals.clear();
    faceless.dropped_triangles = 2;
    EXPECT_TRUE(refused({named(cube({0, 0, 0}), "a.ply"), named(faceless, "b.ply")}, at_depth(6))
                    .message.starts_with("b.ply: no face is left"));
    Surface loose = cube({0, 0, 0});
    loose.positions.emplace_back(9, 9, 9);
    BuildStatistics said;
    const Model model = built({named(cloud({0, 0, 0}), "a.ply"), named(loose, "b.ply")}, at_depth(6), &said);
    EXPECT_EQ(lines_of(said), std::vector<std::string>{"b.ply: loose vertices"});
    EXPECT_LT(model.parameters.grid.edge(), 3) << "a loose vertex takes no part";
}

TEST(Merge, InputsWithoutPointsAreLeftOut) {
    BuildOptions options = at_depth(6);
    options.viewpoints = {{9, 9, 9}, {-9, 0, 0}, {0, 9, 0}};
    const Surface nothing, a = named(cloud({0, 0, 0}), "a.ply"), b = named(cloud({3, 0, 0}), "b.ply");
    const Model with = built({named(nothing, "empty.las"), a, b}, options);
    options.viewpoints.erase(options.viewpoints.begin()); // of the first input
    const Model without = built({a, b}, options);
    EXPECT_EQ(with.levels.back().masks, without.levels.back().masks);
    EXPECT_EQ(with.levels.back().points.normals, without.levels.back().points.normals);
    EXPECT_EQ(refused({nothing, nothing}, options).message, "no input has a point left: there is nothing to build");
}

TEST(Merge, MaxPointsHoldsForMeshesAndPointsTogether) {
    BuildOptions options;
    options.grid.max_points = 20000;
    const Model model = built({cube({0, 0, 0}), cloud({4, 0, 0}, 50000)}, options);
    EXPECT_LE(model.point_count(), 20000U);
    EXPECT_GT(model.point_count(), 4000U);
}

TEST(TwoSided, APointThatIsGivenAsTwoSidedStaysSo) {
    Surface points = cloud({0, 0, 0}, 3);
    points.normals = {{0, 0, -1}, {-1, 0, 0}, {0, -1, 0}};
    points.two_sided = {1, 0, 1};
    const Model model = built({points}, at_depth(6));
    for (std::size_t i = 0; i < 3; ++i) {
        const std::uint16_t normal = model.levels.back().points.normals[point_at(model, points.positions[i])];
        const glm::vec3 &n = points.normals[i];
        EXPECT_EQ(normal & kNormalIndexMask, quantise_normal(n.x, n.y, n.z));
        EXPECT_EQ((normal & kTwoSidedBit) != 0, points.two_sided[i] != 0);
    }
}

TEST(Placement, ScalesThenShifts) {
    Surface surface = cube({0.5, 0, 0});
    surface.radii.assign(8, 0.25F);
    surface.stations = {{1000, 0, 0}};
    place(surface, {.scale = 0.001, .origin = std::array<double, 3>{8.5e6, -3, 0.5}});
    EXPECT_EQ(surface.positions[0], glm::dvec3(8.5e6 + -0.5 * 0.001, -3 - 0.001, 0.5 - 0.001));
    EXPECT_FLOAT_EQ(surface.radii[0], 0.00025F);
    EXPECT_EQ(surface.stations[0], glm::dvec3(8.5e6 + 1, -3, 0.5));
    Surface same = cube({0.1, 0.2, 0.3});
    const Surface before = same;
    place(same, {});
    EXPECT_EQ(same.positions, before.positions);
    Surface huge = cube({0, 0, 0});
    huge.radii.assign(8, 1.0F);
    huge.radii[0] = 0;
    place(huge, {.scale = 1e300, .origin = {}});
    EXPECT_EQ(huge.radii[0], 0) << "none stays none";
    EXPECT_EQ(huge.radii[1], std::numeric_limits<float>::max());
    EXPECT_EQ(refused({huge}, at_depth(6)).code, ErrorCode::too_large);
}

TEST(Placement, AShiftedModelHasTheSameVoxels) {
    // Multiples of 2^-20 can be shifted by 8.5e6 without rounding, so that points stay in the same voxels of edge 2^-5.
    Surface surface = cloud({0, 0, 0});
    for (glm::dvec3 &p : surface.positions)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = std::round(p[axis] * 0x1p20) * 0x1p-20;
    BuildOptions options;
    options.grid.voxel_size = 0x1p-5;
    const Model here = built({surface}, options);
    place(surface, {.scale = {}, .origin = std::array<double, 3>{8.5e6, -8412345, 512.25}});
    const Model there = built({surface}, options);
    EXPECT_EQ(there.levels, here.levels);
    EXPECT_EQ(there.parameters.grid.origin[0], here.parameters.grid.origin[0] + 8.5e6);
}

TEST(Placement, DetailOfHalfAMillimetreSurvivesFarFromTheOrigin) {
    Surface surface = cloud({0, 0, 0}, 20000);
    place(surface, {.scale = 0.25, .origin = std::array<double, 3>{8.5e6, 5.2e6, 300}});
    BuildOptions options;
    options.grid.voxel_size = 0.0005;
    const Model model = built({surface}, options);
    EXPECT_GT(model.point_count(), 19900U) << "nearly every point has a voxel of its own";
    EXPECT_EQ(point_at(model, surface.positions[17]), point_at(model, surface.positions[17] + 1e-9));
}

TEST(Placement, SinglePrecisionThatIsTooCoarseIsReported) {
    const auto report_of = [](double shift, bool single, double scale) {
        Surface surface = cloud({shift, 0, 0});
        if (single)
            for (glm::dvec3 &p : surface.positions)
                for (int axis = 0; axis < 3; ++axis)
                    p[axis] = static_cast<double>(static_cast<float>(p[axis]));
        place(surface, {.scale = scale, .origin = {}});
        BuildStatistics said;
        BuildOptions options;
        options.grid.voxel_size = 0.05 * scale;
        built({surface}, options, &said);
        const auto line = std::find_if(said.attributes.begin(), said.attributes.end(), [](const AttributeReport &each) {
            return each.note.find("single precision") != std::string::npos;
        });
        return line == said.attributes.end() ? std::string() : line->note;
    };
    EXPECT_EQ(
        report_of(8.5e6, true, 1),
        "near 8.5e+06 they have the steps of single precision, 1, and a voxel has 0.05; export the scan with more "
        "digits (doubles), or shifted to its place, and give the shift as --origin");
    EXPECT_EQ(report_of(8.3e6, true, 0.001).substr(0, 80),
              "near 8.3e+06 they have the steps of single precision, 0.0005, and a voxel has 5e");
    EXPECT_EQ(report_of(8.5e6, false, 1), "");
    EXPECT_EQ(report_of(100, true, 1), "") << "steps of 8e-6 do no harm";
}

TEST(GridLike, IsTakenBitForBitWithUnitAndUpAxis) {
    const Grid grid{
        .depth = 7, .origin = {-1.1, -1.7, -1.0 / 3 - 1}, .voxel_size = 0.1 / 3, .unit = Unit::foot, .up = UpAxis::z};
    BuildOptions options;
    options.grid.like = grid;
    options.grid.unit = Unit::metre;
    EXPECT_EQ(built({cube({0, 0, 0})}, options).parameters.grid, grid);
}

TEST(GridLike, IsReadFromAFile) {
    const Model model = built({cube({0.1, 0.2, 0.3})}, at_depth(6));
    const auto path =
        std::filesystem::temp_directory_path() / ("pbm_grid_like_" + std::to_string(::getpid()) + ".pbvg");
    ASSERT_TRUE(write_model(path.string(), model).ok());
    const Result<Grid> grid = read_grid(path.string());
    std::filesystem::remove(path);
    ASSERT_TRUE(grid.ok());
    EXPECT_EQ(*grid, model.parameters.grid);
    EXPECT_EQ(read_grid(path.string()).error().code, ErrorCode::io);
}

TEST(GridLike, PointsOutsideAreRefused) {
    BuildOptions options;
    options.grid.like = Grid{.depth = 5, .origin = {-1, -1, -1}, .voxel_size = 2.0 / 32};
    built({cube({0, 0, 0})}, options); // touches all its faces
    const Error error = refused({cube({0, 0, 0.125})}, options);
    EXPECT_EQ(error.code, ErrorCode::usage);
    EXPECT_EQ(error.message, "the scan reaches from -0.875 to 1.125 along z, the grid of --grid-like from -1 to 1; "
                             "choose a larger grid, or --scale and --origin");
    options.grid.like->depth = 4;
    EXPECT_EQ(refused({cube({0, 0, 0})}, options).message, "the grid of --grid-like has depth 4, the least is 5");
}

TEST(GridChoice, VoxelsFinerThanCoordinatesCanBeAreRefused) {
    BuildOptions options;
    options.grid.voxel_size = 1e-9;
    EXPECT_EQ(refused({cube({8.5e6, 0, 0})}, options).message,
              "a voxel size of 1e-09 is finer than coordinates of 8.5e+06 can be; use at least 1.21e-07");
}

} // namespace
