// --fill-holes: which loops of a border are closed, and what their patches are like.
#include "pbm_build/hole_filling/sparse_cholesky.h"
#include "unit/build/built_models.h"
#include "unit/build/small_meshes.h"

#include <map>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// An octahedron whose faces are split into n x n, on the unit sphere. Colours grow along x.
Surface round_mesh(int n) {
    Surface surface;
    std::map<std::array<int, 3>, std::uint32_t> numbers;
    const auto number = [&](const glm::ivec3 &p) {
        const auto [at, is_new] = numbers.try_emplace({p.x, p.y, p.z}, surface.positions.size());
        if (is_new) {
            surface.positions.push_back(glm::normalize(glm::dvec3(p)));
            const auto shade = static_cast<std::uint8_t>(128 + 100 * surface.positions.back().x);
            surface.colours.push_back({shade, 50, static_cast<std::uint8_t>(255 - shade)});
        }
        return at->second;
    };
    for (int octant = 0; octant < 8; ++octant) {
        const glm::ivec3 x((octant & 1) != 0 ? 1 : -1, 0, 0), y(0, (octant & 2) != 0 ? 1 : -1, 0),
            z(0, 0, (octant & 4) != 0 ? 1 : -1);
        const bool mirrored = x.x * y.y * z.z < 0;
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            surface.triangles.emplace_back(a, mirrored ? c : b, mirrored ? b : c);
        };
        const auto at = [&](int i, int j) { return number(x * (n - i - j) + y * i + z * j); };
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) {
                add(at(i, j), at(i + 1, j), at(i, j + 1));
                if (i + j + 1 < n)
                    add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            }
    }
    return surface;
}

// Without the faces that lie above a plane.
Surface without_cap(Surface surface, const glm::dvec3 &up, double height) {
    std::vector<std::uint8_t> removed;
    for (const glm::dvec3 &p : surface.positions)
        removed.push_back(glm::dot(p, glm::normalize(up)) > height ? 1 : 0);
    erase_vertices(surface, removed);
    return surface;
}

std::string filled(Surface &surface, int edges) { return repaired(surface, {.max_hole_edges = edges}).note; }

TEST(FillHoles, ACubeGetsItsFaceBack) {
    for (const int first : {0, 2, 4, 6, 8, 10})
        for (const bool is_split : {false, true}) {
            Surface surface = is_split ? split(box()) : box();
            const auto begin = surface.triangles.begin() + first;
            surface.triangles.erase(begin, begin + 2);
            EXPECT_EQ(filled(surface, 3),
                      "0 of 1 loop of the border closed; 1 longer than 3 edges, the shortest of them has 4");
            EXPECT_EQ(filled(surface, 4), "1 of 1 loop of the border closed, with 2 faces and 0 vertices");
            EXPECT_TRUE(figures(surface).is_closed());
            EXPECT_EQ(figures(surface).turned_faces, 0U);
            EXPECT_NEAR(volume(surface), 1, 1e-12);
            EXPECT_EQ(filled(surface, 4), "none: the mesh has no border");
        }
}

TEST(FillHoles, ACapContinuesItsSphereAndItsColours) {
    for (const glm::dvec3 &up : {glm::dvec3(0, 0, 1), glm::dvec3(3, 2, 1), glm::dvec3(-1, 0, -2)}) {
        Surface surface = without_cap(round_mesh(16), up, 0.8);
        const std::size_t vertices = surface.positions.size(), faces = surface.triangles.size();
        EXPECT_EQ(figures(surface).border_loops, 1U);
        EXPECT_EQ(filled(surface, 100).find("1 of 1 loop of the border closed, with "), 0U);
        EXPECT_TRUE(figures(surface).is_closed());
        EXPECT_EQ(figures(surface).genus, 0U);
        EXPECT_EQ(figures(surface).turned_faces, 0U);
        ASSERT_GT(surface.positions.size(), vertices + 50);
        ASSERT_EQ(surface.colours.size(), surface.positions.size());
        for (std::size_t i = vertices; i < surface.positions.size(); ++i) {
            EXPECT_NEAR(glm::length(surface.positions[i]), 1, 0.03) << "a flat patch has 0.8";
            EXPECT_NEAR(surface.colours[i][0], 128 + 100 * surface.positions[i].x, 25);
            EXPECT_EQ(surface.colours[i][1], 50);
        }
        double longest = 0;
        for (std::size_t i = faces; i < surface.triangles.size(); ++i) {
            const glm::uvec3 &t = surface.triangles[i];
            longest = std::max(longest, glm::distance(surface.positions[t.x], surface.positions[t.y]));
        }
        EXPECT_LT(longest, 0.3) << "edges around are 0.09 to 0.17 long";
    }
}

TEST(FillHoles, FarFromTheOriginAndInAnyUnitACapContinuesItsSphere) {
    const glm::dvec3 centre(5e5, 4e6, 0);
    for (const double radius : {1e-3, 1e3}) {
        Surface surface = without_cap(round_mesh(16), {0, 0, 1}, 0.8);
        const std::size_t given = surface.positions.size();
        for (glm::dvec3 &p : surface.positions)
            p = radius * p + centre;
        filled(surface, 100);
        ASSERT_GT(surface.positions.size(), given + 50);
        for (std::size_t i = given; i < surface.positions.size(); ++i)
            EXPECT_NEAR(glm::distance(surface.positions[i], centre), radius, 0.03 * radius);
    }
}

TEST(FillHoles, HolesThatTouchAreAllFilled) {
    Surface surface = box();
    std::erase(surface.triangles, glm::uvec3(0, 4, 6));
    std::erase(surface.triangles, glm::uvec3(1, 3, 7));
    std::erase(surface.triangles, glm::uvec3(0, 2, 3));
    EXPECT_EQ(filled(surface, 3), "3 of 3 loops of the border closed, with 3 faces and 0 vertices");
    EXPECT_TRUE(figures(surface).is_closed());
    EXPECT_EQ(figures(surface).complex_vertices, 0U);
    EXPECT_NEAR(volume(surface), 1, 1e-12);
}

TEST(FillHoles, NoFillMakesAComplexEdge) {
    Surface tube = box(); // without two opposite faces, and with a diagonal between the rims of none
    std::erase_if(tube.triangles,
                  [](const glm::uvec3 &t) { return t == glm::uvec3(0, 4, 6) || t == glm::uvec3(0, 6, 2); });
    tube.triangles.emplace_back(0, 6, 5); // its edge 0-6 lies across the hole
    const MeshFigures before = figures(tube);
    filled(tube, 100);
    EXPECT_EQ(figures(tube).complex_edges, before.complex_edges);
    Surface quad; // two triangles: the other diagonal is free
    quad.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.5}, {0, 1, 0}};
    quad.triangles = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(filled(quad, 4), "1 of 1 loop of the border closed, with 2 faces and 0 vertices");
    EXPECT_TRUE(figures(quad).is_closed());
    EXPECT_EQ(figures(quad).complex_edges, 0U);
    EXPECT_EQ(figures(quad).repeated_faces, 0U);
}

TEST(FillHoles, LoopsThatAreComplexOrWithoutASurfaceAcrossAreLeft) {
    Surface fan;
    fan.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
    fan.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
    EXPECT_EQ(filled(fan, 100).find("0 of "), 0U);
    EXPECT_EQ(fan.triangles.size(), 3U);
    Surface triangle;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    EXPECT_EQ(filled(triangle, 3), "0 of 1 loop of the border closed; 1 left: complex, or without a surface across");
    Surface crack = box(); // a vertex on the edge of one of its two faces
    std::erase(crack.triangles, glm::uvec3(0, 4, 6));
    crack.positions.emplace_back(0, 0.5, 0.5);
    crack.triangles.insert(crack.triangles.end(), {{0, 4, 8}, {4, 6, 8}});
    EXPECT_EQ(filled(crack, 3), "0 of 1 loop of the border closed; 1 left: complex, or without a surface across");
}

TEST(FillHoles, AFilledSheetIsWoundAlikeThenOutwards) {
    Surface surface = box();
    surface.triangles.erase(surface.triangles.begin(), surface.triangles.begin() + 2);
    reverse_faces(surface);
    reverse_face(surface, 3);
    BuildStatistics statistics;
    ASSERT_TRUE(repair_mesh(surface, {.winding = {.keep = true}, .max_hole_edges = 4}, 1, statistics).ok());
    EXPECT_EQ(figures(surface).turned_faces, 1U);
    EXPECT_EQ(figures(surface).inward_sheets, 1U);
    surface.triangles.resize(10); // without the fill
    ASSERT_TRUE(repair_mesh(surface, {.winding = {.requested = true}, .max_hole_edges = 4}, 1, statistics).ok());
    EXPECT_NEAR(volume(surface), 1, 1e-12) << "it has an outside once it is closed";
}

TEST(FillHoles, WhatWasMeasuredIsNotMadeUp) {
    Surface surface = without_cap(round_mesh(8), {0, 0, 1}, 0.6);
    const std::size_t given = surface.positions.size();
    surface.colours = {};
    surface.normals.assign(given, {0, 0, 1});
    surface.radii.assign(given, 1);
    for_byte_attributes([&](auto &values) { values.assign(given, 1); }, surface);
    surface.materials.resize(2);
    surface.station_ids.assign(given, 0);
    surface.stations.resize(1);
    surface.field_values[0].assign(given, {5});
    surface.positions.emplace_back(9, 9, 9); // a point beside the triangles
    for_vertex_attributes([&](auto &values) { values.resize(values.empty() ? 0 : given + 1); }, surface);
    surface.points_beside_triangles = 1;
    filled(surface, 100);
    ASSERT_GT(surface.positions.size(), given + 1);
    EXPECT_EQ(surface.positions.back(), glm::dvec3(9, 9, 9));
    EXPECT_TRUE(surface.colours.empty());
    for (std::size_t i = given; i + 1 < surface.positions.size(); ++i) {
        EXPECT_EQ(surface.normals[i], glm::vec3(0));
        EXPECT_EQ(surface.radii[i], 0);
        for_byte_attributes([&](const auto &values) { EXPECT_EQ(values[i], 1); }, surface);
        EXPECT_EQ(surface.station_ids[i], kNoStation);
        EXPECT_TRUE(std::isnan(surface.field_values[0][i].number));
    }
    for_vertex_attributes(
        [&](auto &values) { EXPECT_TRUE(values.empty() || values.size() == surface.positions.size()); }, surface);
}

TEST(FillHoles, PatchesBesideColouredFacesHaveTheirColours) {
    Surface surface = box();
    surface.triangles.erase(surface.triangles.begin(), surface.triangles.begin() + 2);
    surface.face_colours.assign(10, {{200, 100, 0}, true});
    filled(surface, 4);
    EXPECT_EQ(surface.positions.size(), 8U);
    EXPECT_TRUE(surface.colours.empty());
    EXPECT_EQ(surface.face_colours, std::vector<FaceColour>(12, {{200, 100, 0}, true}));
}

TEST(FillHoles, PatchesBesideImagesHaveTheirColours) {
    Surface surface = box();
    surface.triangles.erase(surface.triangles.begin(), surface.triangles.begin() + 2);
    surface.textures.resize(1);
    surface.textures[0] = {.width = 2, .height = 1, .texels = {{200, 100, 0, 255}, {0, 0, 0, 255}}};
    surface.texture_ids.assign(10, 0);
    surface.texture_corners.assign(10, {glm::vec2(0, 0), glm::vec2(0.4, 0), glm::vec2(0.2, 1)});
    filled(surface, 4);
    ASSERT_EQ(surface.positions.size(), 12U) << "four vertices of its own";
    ASSERT_EQ(surface.triangles.size(), 12U);
    EXPECT_EQ(surface.texture_ids.back(), Surface::kNoTexture);
    EXPECT_EQ(surface.texture_corners.size(), 12U);
    for (std::size_t i = 8; i < 12; ++i)
        EXPECT_EQ(surface.colours[i], (Rgb8{200, 100, 0}));
    EXPECT_TRUE(figures(surface).is_closed());
}

TEST(FillHoles, BuiltModelsDoNotDependOnTheOrderOfFacesAndVertices) {
    Surface surface = without_cap(without_cap(round_mesh(12), {0, 0, 1}, 0.7), {1, -1, -1}, 0.9);
    Surface other = box({3, 0, 0});
    other.colours.resize(8);
    other.triangles.erase(other.triangles.begin(), other.triangles.begin() + 3);
    append_faces(surface, other);
    surface.colours.resize(surface.positions.size());
    BuildOptions options;
    options.grid.depth = 6;
    options.mesh = {.report = true, .winding = {.requested = true}, .max_hole_edges = 100};
    const Bytes expected = file_of(built(surface, options));
    for (unsigned seed = 0; seed < 5; ++seed)
        EXPECT_EQ(file_of(built(shuffled(surface, seed), options)), expected) << seed;
    options.threads = 1;
    EXPECT_EQ(file_of(built(surface, options)), expected);
}

TEST(SparseCholesky, SolvesEquationsOfAGridAndRefusesIndefiniteOnes) {
    constexpr std::uint32_t kWidth = 30, kCount = kWidth * kWidth;
    std::mt19937 random(1);
    std::vector<glm::dvec3> expected, right(kCount);
    SymmetricMatrix matrix;
    for (std::uint32_t i = 0; i < kCount; ++i) {
        expected.emplace_back(random() % 100, random() % 100, i);
        for (const int step : {-static_cast<int>(kWidth), -1, 0, 1, static_cast<int>(kWidth)}) {
            const int column = static_cast<int>(i) + step;
            const bool wraps = (step == -1 && i % kWidth == 0) || (step == 1 && i % kWidth == kWidth - 1);
            if (column < 0 || column >= static_cast<int>(kCount) || wraps)
                continue;
            matrix.columns.push_back(column);
            matrix.values.push_back(step == 0 ? 4.01 : -1);
        }
        matrix.starts.push_back(static_cast<std::int32_t>(matrix.columns.size()));
    }
    for (std::size_t i = 0; i < kCount; ++i)
        for (auto k = static_cast<std::size_t>(matrix.starts[i]); k < static_cast<std::size_t>(matrix.starts[i + 1]);
             ++k)
            right[i] += matrix.values[k] * expected[static_cast<std::size_t>(matrix.columns[k])];
    const auto solution = solve(matrix, right);
    ASSERT_TRUE(solution);
    for (std::size_t i = 0; i < kCount; ++i)
        EXPECT_LT(glm::distance((*solution)[i], expected[i]), 1e-8);
    matrix.values[0] = -4;
    EXPECT_FALSE(solve(matrix, right));
}

} // namespace
