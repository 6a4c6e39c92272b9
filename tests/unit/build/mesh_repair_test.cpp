// How faces are connected, what --mesh-report says of it, and repairs of them.
#include "pbm_build/mesh_repair/repair_mesh.h"
#include "unit/build/built_models.h"
#include "unit/build/small_meshes.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

TEST(MeshReport, ACubeIsClosedAndItsSeamsAreNoBorder) {
    for (const Surface &surface : {box(), split(box()), shuffled(split(box()), 1)}) {
        const MeshFigures f = figures(surface);
        EXPECT_EQ(f.vertices, 8U);
        EXPECT_EQ(f.positions, surface.positions.size());
        EXPECT_EQ(f.edges, 18U);
        EXPECT_EQ(f.faces, 12U);
        EXPECT_TRUE(f.is_closed());
        EXPECT_EQ(f.parts, 1U);
        EXPECT_EQ(f.closed_parts, 1U);
        EXPECT_EQ(f.turned_faces + f.inward_sheets + f.complex_edges + f.complex_vertices, 0U);
        EXPECT_EQ(f.euler_characteristic, 2);
        EXPECT_EQ(f.genus, 0U);
    }
}

TEST(MeshReport, AFaceAgainstItsNeighboursIsCounted) {
    Surface surface = box();
    std::swap(surface.triangles[7].x, surface.triangles[7].y);
    EXPECT_EQ(figures(surface).turned_faces, 1U);
    EXPECT_EQ(figures(surface).inward_sheets, 0U);
    EXPECT_EQ(figures(shuffled(surface, 2)).turned_faces, 1U);
    reverse_faces(surface);
    EXPECT_EQ(figures(surface).turned_faces, 1U);
    EXPECT_EQ(figures(surface).inward_sheets, 1U);
}

TEST(MeshReport, HolesAndPartsAreCounted) {
    Surface surface = box();
    surface.triangles.erase(surface.triangles.begin(), surface.triangles.begin() + 3); // a quad, and a triangle
    append_faces(surface, box({5, 0, 0}));
    surface.positions.emplace_back(9, 9, 9);
    surface.triangles.emplace_back(16, 15, 15);
    const MeshFigures f = figures(surface);
    EXPECT_EQ(f.parts, 2U);
    EXPECT_EQ(f.closed_parts, 1U);
    EXPECT_EQ(f.largest_part_faces, 12U);
    EXPECT_NEAR(f.largest_part_share, 6 / 10.5, 1e-12);
    EXPECT_EQ(f.border_loops, 2U);
    EXPECT_EQ(f.border_edges, 7U);
    EXPECT_EQ(f.longest_loop, 4U);
    EXPECT_EQ(f.flat_faces, 1U);
    EXPECT_EQ(f.isolated_vertices, 0U) << "a flat face has it";
    EXPECT_EQ(f.genus, 0U);
    surface.triangles.pop_back();
    EXPECT_EQ(figures(surface).isolated_vertices, 1U);
}

TEST(MeshReport, HolesThatTouchInAVertexAreTwoLoops) {
    Surface surface = box();
    std::erase(surface.triangles, glm::uvec3(0, 4, 6));
    std::erase(surface.triangles, glm::uvec3(1, 3, 7));
    EXPECT_EQ(figures(surface).border_loops, 2U);
    EXPECT_EQ(figures(surface).longest_loop, 3U);
    std::erase(surface.triangles, glm::uvec3(0, 2, 3)); // touches both, in vertices 0 and 3
    const MeshFigures f = figures(surface);
    EXPECT_EQ(f.border_loops, 3U);
    EXPECT_EQ(f.longest_loop, 3U);
    EXPECT_EQ(f.complex_vertices, 2U);
    EXPECT_FALSE(f.genus);
}

TEST(MeshReport, AMoebiusStripHasOneSideAndARingTwo) {
    const MeshFigures moebius = figures(shuffled(strip(12, 1), 3)), ring = figures(strip(12, 2));
    EXPECT_EQ(moebius.one_sided_sheets, 1U);
    EXPECT_FALSE(moebius.genus);
    EXPECT_EQ(moebius.border_edges, 24U);
    EXPECT_EQ(moebius.complex_vertices, 0U) << "the cut is none";
    EXPECT_EQ(ring.one_sided_sheets, 0U);
    EXPECT_EQ(ring.border_loops, 2U);
    EXPECT_EQ(ring.longest_loop, 12U);
    EXPECT_EQ(ring.genus, 0U);
}

TEST(MeshReport, ATorusHasAHandle) {
    constexpr unsigned kSides = 8;
    Surface surface;
    const double step = 2 * std::acos(-1.0) / kSides;
    for (unsigned i = 0; i < kSides; ++i)
        for (unsigned j = 0; j < kSides; ++j) {
            const double r = 2 + std::cos(j * step);
            surface.positions.emplace_back(r * std::cos(i * step), r * std::sin(i * step), std::sin(j * step));
        }
    for (unsigned i = 0; i < kSides; ++i)
        for (unsigned j = 0; j < kSides; ++j) {
            const unsigned a = i * kSides + j, b = i * kSides + (j + 1) % kSides, c = (i + 1) % kSides * kSides + j,
                           d = (i + 1) % kSides * kSides + (j + 1) % kSides;
            surface.triangles.insert(surface.triangles.end(), {{a, c, d}, {a, d, b}});
        }
    EXPECT_EQ(figures(surface).genus, 1U);
    EXPECT_EQ(figures(surface).euler_characteristic, 0);
    EXPECT_EQ(figures(surface).inward_sheets, 0U);
}

TEST(MeshReport, AFanOfThreeFacesAtOneEdgeIsComplex) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
    surface.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
    const MeshFigures f = figures(surface);
    EXPECT_EQ(f.complex_edges, 1U);
    EXPECT_EQ(f.complex_vertices, 2U);
    EXPECT_EQ(f.parts, 1U) << "parts are connected through complex edges";
    EXPECT_EQ(f.border_edges, 6U);
    EXPECT_EQ(f.turned_faces, 0U) << "a complex edge says nothing of winding";
    EXPECT_FALSE(f.genus);
    surface.triangles.emplace_back(2, 0, 1);
    surface.triangles.emplace_back(1, 0, 2);
    EXPECT_EQ(figures(surface).repeated_faces, 2U);
    EXPECT_EQ(figures(surface).complex_edges, 1U);
}

TEST(MeshReport, ALargeFanTakesNoQuadraticTime) {
    constexpr std::uint32_t kSides = 200000;
    Surface surface;
    surface.positions.emplace_back(0, 0, 1);
    for (std::uint32_t i = 0; i < kSides; ++i)
        surface.positions.emplace_back(std::cos(i * 1e-5), std::sin(i * 1e-5), 0);
    for (std::uint32_t i = 1; i < kSides; ++i)
        surface.triangles.emplace_back(0, i, i + 1);
    EXPECT_EQ(figures(surface).longest_loop, kSides + 1);
}

TEST(MeshReport, PointsHaveNoMesh) {
    Surface surface = box();
    surface.triangles.clear();
    BuildStatistics statistics;
    ASSERT_TRUE(repair_mesh(surface, {.report = true}, 1, statistics).ok());
    EXPECT_TRUE(statistics.meshes.empty());
    ASSERT_EQ(statistics.attributes.size(), 1U);
    EXPECT_EQ(statistics.attributes.front().fate, Fate::dropped);
}

TEST(OrientFaces, AFaceOfACubeIsTurnedAndNothingElse) {
    Surface surface = box();
    std::swap(surface.triangles[7].x, surface.triangles[7].y);
    const AttributeReport line = repaired(surface, {.winding = {.requested = true}});
    EXPECT_EQ(line.fate, Fate::converted);
    EXPECT_EQ(line.note, "1 face turned");
    EXPECT_NEAR(volume(surface), 1, 1e-12);
    EXPECT_EQ(repaired(surface, {.winding = {.requested = true}}).fate, Fate::kept);
}

TEST(OrientFaces, ClosedPartsLookOutwardsOpenOnesKeepTheLargerSide) {
    Surface surface = split(box());
    reverse_faces(surface); // inside out
    append_faces(surface, strip(12, 0));
    for (std::size_t i = 12; i < 20; ++i)
        reverse_face(surface, i); // 8 of 24
    const Surface before = surface;
    EXPECT_EQ(repaired(surface, {.winding = {.requested = true}}).note, "20 faces turned");
    for (std::size_t i = 20; i < surface.triangles.size(); ++i)
        EXPECT_EQ(surface.triangles[i], before.triangles[i]);
    surface.triangles.resize(12);
    EXPECT_NEAR(volume(surface), 1, 1e-12);
}

TEST(OrientFaces, NormalsAreTurnedWithFacesThatTheyAgreedWith) {
    for (const bool agree : {true, false}) {
        Surface surface = box({-0.5, -0.5, -0.5});
        reverse_faces(surface);
        for (const glm::dvec3 &p : surface.positions)
            surface.normals.emplace_back(agree ? -p : p);
        const AttributeReport line = repaired(surface, {.winding = {.requested = true}});
        EXPECT_EQ(line.note, agree ? "12 faces turned, and 8 normals with them" : "12 faces turned");
        for (std::size_t i = 0; i < 8; ++i)
            EXPECT_GT(glm::dot(surface.normals[i], glm::vec3(surface.positions[i])), 0);
    }
    Surface one = box({-0.5, -0.5, -0.5});
    for (const glm::dvec3 &p : one.positions)
        one.normals.emplace_back(p);
    const std::vector<glm::vec3> before = one.normals;
    reverse_face(one, 4);
    EXPECT_EQ(repaired(one, {.winding = {.requested = true}}).note, "1 face turned");
    EXPECT_EQ(one.normals, before) << "their other faces were right";
}

TEST(OrientFaces, PlacesInTexturesFollow) {
    Surface surface = box();
    surface.textures.resize(1);
    surface.texture_ids.assign(12, 0);
    surface.texture_corners.assign(12, {glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, 1)});
    reverse_face(surface, 5);
    const auto before = surface.texture_corners[5];
    repaired(surface, {.winding = {.requested = true}});
    EXPECT_EQ(surface.texture_corners[5], (TextureCorners{before[0], before[2], before[1]}));
}

TEST(OrientFaces, OneSideBothWaysAndComplexEdgesAreNoObstacle) {
    Surface moebius = strip(12, 1);
    EXPECT_NE(repaired(moebius, {.winding = {.requested = true}}).note.find("1 sheet with one side only"),
              std::string::npos);
    Surface both = strip(12, 0);
    const std::vector<glm::uvec3> front = both.triangles;
    reverse_faces(both);
    both.triangles.insert(both.triangles.end(), front.begin(), front.end());
    EXPECT_EQ(repaired(both, {.winding = {.requested = true}}).note, "no face had to be turned");
    Surface pair = box(); // two cubes that share an edge of four faces
    append_faces(pair, box({1, 1, 0}));
    reverse_faces(pair);
    EXPECT_EQ(figures(pair).complex_edges, 1U);
    EXPECT_EQ(repaired(pair, {.winding = {.requested = true}}).note, "24 faces turned");
    EXPECT_NEAR(volume(pair), 2, 1e-12);
}

TEST(DropParts, PartsBelowAShareOfTheLargestAreaAreDroppedWithTheirVertices) {
    Surface scrap = box({0, 0, 5});
    for (glm::dvec3 &p : scrap.positions)
        p.x *= 0.01, p.y *= 0.01; // area 0.0402, that of a cube is 6
    Surface surface = scrap;
    append_faces(surface, box());
    for (glm::dvec3 &p : scrap.positions)
        p.x += 3;
    append_faces(surface, scrap);
    surface.positions.emplace_back(1, 2, 3); // loose before
    surface.colours.resize(surface.positions.size());
    surface.colours[8] = {1, 2, 3};
    Surface kept = surface;
    EXPECT_EQ(repaired(kept, {.smallest_part = PartSize{.percent = 0.66}}).fate, Fate::kept);
    EXPECT_EQ(kept.triangles, surface.triangles);
    const AttributeReport line = repaired(surface, {.smallest_part = PartSize{.percent = 0.68}});
    EXPECT_EQ(line.fate, Fate::dropped);
    EXPECT_EQ(line.note, "2 of 3 parts, with 24 faces and 1.32 % of the area: smaller than 0.68 % of the area of "
                         "the largest part");
    EXPECT_EQ(surface.triangles, box().triangles);
    EXPECT_EQ(surface.positions.size(), 9U);
    ASSERT_EQ(surface.colours.size(), 9U);
    EXPECT_EQ(surface.colours[0], (Rgb8{1, 2, 3}));
}

TEST(DropParts, PartsOfFewFacesAreDroppedUnlessNothingWouldBeLeft) {
    Surface surface = box();
    append_faces(surface, strip(12, 0));
    surface.triangles.emplace_back(surface.triangles[3].z, surface.triangles[3].y, surface.triangles[3].x); // repeated
    Surface same = surface, none = surface;
    EXPECT_EQ(repaired(same, {.smallest_part = PartSize{.faces = 12}}).fate, Fate::kept);
    repaired(surface, {.smallest_part = PartSize{.faces = 13}});
    EXPECT_EQ(surface.triangles.size(), 24U);
    EXPECT_EQ(surface.positions.size(), 24U);
    BuildStatistics statistics;
    const Status refused = repair_mesh(none, {.smallest_part = PartSize{.faces = 25}}, 1, statistics);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
}

TEST(DropParts, SizesArePercentagesOrFaces) {
    EXPECT_EQ(value_of(parse_part_size("1.5%")).percent, 1.5);
    EXPECT_EQ(value_of(parse_part_size("200")).faces, 200U);
    for (const char *text : {"", "%", "0", "0%", "-1", "101%", "nan%", "1.5", "2 %", "2%%", "1e400%"})
        EXPECT_FALSE(parse_part_size(text).ok()) << text;
    for (const char *text : {"1.5%", "200"})
        EXPECT_EQ(to_text(value_of(parse_part_size(text))), text);
}

TEST(MeshRepair, BuiltModelsDoNotDependOnTheOrderOfFacesAndVertices) {
    Surface surface = strip(40, 1);
    append_faces(surface, box({3, 0, 0}));
    append_faces(surface, box({4, 1, 0}));
    append_faces(surface, strip(5, 3));
    for (std::size_t i = 0; i < surface.triangles.size(); i += 3)
        reverse_face(surface, i);
    BuildOptions options;
    options.grid.depth = 6;
    options.mesh = {.report = true, .winding = {.requested = true}, .smallest_part = PartSize{.faces = 11}};
    const Bytes expected = file_of(built(surface, options));
    for (unsigned seed = 0; seed < 5; ++seed)
        EXPECT_EQ(file_of(built(shuffled(surface, seed), options)), expected) << seed;
}

} // namespace
