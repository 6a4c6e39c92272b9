// What the builder knows of every mesh: whether it is closed, and which way its faces look.
#include "pbm_build/winding/edge_joins.h"
#include "pbm_build/winding/wind_faces.h"
#include "unit/build/built_models.h"
#include "unit/build/small_meshes.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

struct Wound {
    std::vector<AttributeReport> lines;
    bool closed;
};

Wound wind(Surface &surface, const WindingRequest &request = {}) {
    BuildStatistics statistics;
    wind_faces(surface, request, 1, statistics);
    return {statistics.attributes, surface.closed};
}

Surface reversed(Surface surface) {
    reverse_faces(surface);
    return surface;
}

Surface scaled(Surface surface, double factor) {
    for (glm::dvec3 &p : surface.positions)
        p *= factor;
    return surface;
}

Surface together(Surface surface, const Surface &other) {
    append_faces(surface, other);
    return surface;
}

// With normals that point away from the origin.
Surface with_normals(Surface surface, float sign = 1) {
    for (const glm::dvec3 &p : surface.positions)
        surface.normals.push_back(sign * glm::vec3(glm::normalize(p)));
    return surface;
}

const glm::dvec3 kMiddle(-0.5, -0.5, -0.5);

TEST(Winding, ARightMeshStaysAsItIsWithoutALine) {
    for (const Surface &right : {box(), split(box()), shuffled(split(box()), 5), together(box(), box({1, 1, 0})),
                                 with_normals(box(kMiddle)), together(scaled(box(kMiddle), 4), box(kMiddle))}) {
        Surface surface = right;
        const Wound wound = wind(surface);
        EXPECT_TRUE(wound.closed);
        EXPECT_TRUE(wound.lines.empty());
        EXPECT_EQ(surface.triangles, right.triangles);
        EXPECT_EQ(surface.normals, right.normals);
    }
}

TEST(Winding, AnOpenMeshOfOneWindingStaysAsItIs) {
    Surface cut = box();
    cut.triangles.pop_back();
    Surface cut_middle = box(kMiddle);
    cut_middle.triangles.pop_back();
    for (const Surface &open : {cut, reversed(cut), strip(12, 0), together(box({5, 0, 0}), strip(12, 2)),
                                with_normals(reversed(cut_middle))}) {
        Surface surface = open;
        EXPECT_FALSE(wind(surface).closed);
        EXPECT_EQ(surface.triangles, open.triangles);
        EXPECT_EQ(surface.normals, open.normals);
    }
}

TEST(Winding, ClosedPartsThatLookInwardsAreTurnedWithALine) {
    for (const Surface &inward : {box(), split(box()), together(box(), box({3, 0, 0}))}) {
        Surface surface = reversed(inward);
        const Wound wound = wind(surface);
        EXPECT_TRUE(wound.closed);
        EXPECT_GT(volume(surface), 0.9);
        ASSERT_EQ(wound.lines.size(), 1U);
        EXPECT_EQ(wound.lines[0].warning, Warning::turned_faces);
    }
    Surface one = together(box(), reversed(box({3, 0, 0})));
    EXPECT_EQ(wind(one).lines.at(0).note, "1 closed sheet looked inwards: 12 faces turned");
    EXPECT_NEAR(volume(one), 2, 1e-12);
}

TEST(Winding, FacesOfTwoWindingsAreWoundAlike) {
    for (const Surface &right : {box(), split(box()), strip(40, 0), strip(40, 2)}) {
        Surface surface = right;
        for (std::size_t i = 0; i < surface.triangles.size(); i += 3)
            reverse_face(surface, i);
        const Wound wound = wind(surface);
        EXPECT_EQ(wound.closed, right.triangles.size() == 12);
        ASSERT_EQ(wound.lines.size(), 1U);
        EXPECT_NE(wound.lines[0].note.find("1 sheet had two windings"), std::string::npos) << wound.lines[0].note;
        EXPECT_EQ(figures(surface).turned_faces, 0U);
        EXPECT_TRUE(surface.two_sided.empty());
    }
}

TEST(Winding, WhatHasOneSideShowsBothWhereItsWindingsMeet) {
    Surface surface = strip(12, 1);
    const Wound wound = wind(surface);
    EXPECT_FALSE(wound.closed);
    ASSERT_EQ(wound.lines.size(), 1U);
    EXPECT_EQ(wound.lines[0].warning, Warning::one_sided_sheets);
    EXPECT_EQ(std::count(surface.two_sided.begin(), surface.two_sided.end(), 1), 2);
}

TEST(Winding, TheWallOfACavityStaysButNothingElseThatLooksInwards) {
    const Surface large = scaled(box(kMiddle), 4), small = reversed(box(kMiddle));
    for (const Surface &hollow :
         {together(large, small), together(small, large), shuffled(together(large, small), 2)}) {
        Surface surface = hollow;
        const Wound wound = wind(surface);
        EXPECT_TRUE(wound.closed);
        EXPECT_TRUE(wound.lines.empty());
        EXPECT_EQ(surface.triangles, hollow.triangles);
    }
    Surface beside = together(large, reversed(box({3, 0, 0})));
    EXPECT_TRUE(wind(beside).closed);
    EXPECT_NEAR(volume(beside), 65, 1e-9);
    Surface cut = together(large, small); // no closed part encloses the small one
    cut.triangles.erase(cut.triangles.begin());
    EXPECT_EQ(wind(cut).lines.size(), 1U);
    EXPECT_FALSE(cut.closed);
}

TEST(Winding, GivenNormalsOfClosedPartsPointOutwards) {
    for (const bool faces_are_right : {true, false})
        for (const bool normals_are_right : {true, false}) {
            Surface surface = with_normals(box(kMiddle), normals_are_right ? 1 : -1);
            if (!faces_are_right)
                reverse_faces(surface);
            const Wound wound = wind(surface);
            EXPECT_TRUE(wound.closed);
            EXPECT_GT(volume(surface), 0);
            EXPECT_EQ(wound.lines.empty(), faces_are_right && normals_are_right);
            for (std::size_t i = 0; i < 8; ++i)
                EXPECT_GT(glm::dot(surface.normals[i], glm::vec3(surface.positions[i])), 0);
        }
    Surface inverted = with_normals(box(kMiddle), -1);
    const Wound wound = wind(inverted);
    ASSERT_EQ(wound.lines.size(), 1U);
    EXPECT_EQ(wound.lines[0].warning, Warning::turned_normals);
    EXPECT_EQ(wound.lines[0].note, "8 normals of closed sheets turned: most of them pointed inwards");
}

TEST(Winding, NormalsThatFollowedTwoWindingsAreReplaced) {
    Surface surface = with_normals(box(kMiddle));
    for (const std::size_t i : {0U, 1U})
        reverse_face(surface, i);
    surface.normals[0] = -surface.normals[0]; // a corner of four faces of which two are turned
    const Wound wound = wind(surface);
    EXPECT_EQ(surface.normals[0], glm::vec3(0));
    EXPECT_EQ(wound.lines.back().warning, Warning::turned_normals);
    EXPECT_TRUE(wound.closed);
}

TEST(Winding, NormalsThatContradictTheFacesOfAClosedMeshLeaveItsBacksVisible) {
    Surface surface = with_normals(box(kMiddle));
    for (std::size_t i = 0; i < 3; ++i)
        surface.normals[i] = -surface.normals[i];
    const Surface before = surface;
    EXPECT_FALSE(wind(surface).closed);
    EXPECT_EQ(surface.normals, before.normals);
}

TEST(Winding, OptionsWin) {
    Surface surface = reversed(box());
    const Wound kept = wind(surface, {.keep = true});
    EXPECT_FALSE(kept.closed);
    EXPECT_EQ(surface.triangles, reversed(box()).triangles);
    ASSERT_EQ(kept.lines.size(), 1U);
    EXPECT_EQ(kept.lines[0].warning, Warning::inward_faces);
    EXPECT_TRUE(wind(surface, {.flip = true}).closed);
    EXPECT_NEAR(volume(surface), 1, 1e-12);
    EXPECT_FALSE(wind(surface, {.flip = true}).closed) << "a room from within";
    EXPECT_NEAR(volume(surface), -1, 1e-12);
    EXPECT_FALSE(wind(surface, {.requested = true, .flip = true}).closed);
    EXPECT_NEAR(volume(surface), -1, 1e-12) << "outwards, then turned around";
}

TEST(Winding, ComplexEdgesMayBeClosed) {
    Surface pair = box(); // two cubes that share the vertices of an edge of four faces
    Surface other = box({1, 1, 0});
    append_faces(pair, other);
    for (glm::uvec3 &t : pair.triangles)
        for (int corner = 0; corner < 3; ++corner)
            for (std::uint32_t v = 0; v < 8; ++v)
                if (pair.positions[t[corner]] == pair.positions[v])
                    t[corner] = v;
    EXPECT_EQ(join_edges(pair, 1).complex.size(), 4U);
    Surface inward = reversed(pair);
    EXPECT_TRUE(wind(pair).closed);
    EXPECT_TRUE(wind(inward).closed);
    EXPECT_NEAR(volume(inward), 2, 1e-12);
    Surface fin = box(); // a face more at one edge
    fin.positions.emplace_back(2, 2, 2);
    fin.triangles.emplace_back(0, 1, 8);
    EXPECT_FALSE(wind(fin).closed);
}

TEST(Winding, SeamsMayDifferByTheRoundingOfSinglePrecision) {
    for (const double apart : {0.0, 1e-7, 1e-3}) {
        Surface surface = split(reversed(scaled(box(kMiddle), 2)));
        for (std::size_t i = 0; i < surface.positions.size(); ++i)
            surface.positions[i] += apart * glm::dvec3(i % 3 == 0, i % 2, i % 5 == 1);
        EXPECT_EQ(wind(surface).closed, apart < 1e-4) << apart;
        EXPECT_EQ(volume(surface) > 0, apart < 1e-4) << apart;
    }
}

TEST(Winding, ASheetBesideComplexEdgesIsTurnedOnlyIfItIsClosedByItself) {
    Surface dented = box({100, 0, 0}); // with a wall within it: three faces at each of four edges
    dented.triangles.insert(dented.triangles.end(), {{0, 3, 7}, {0, 7, 4}});
    const Surface before = dented;
    EXPECT_FALSE(wind(dented).closed);
    EXPECT_EQ(dented.triangles, before.triangles);
}

TEST(Winding, DependsOnNeitherThreadsNorOrder) {
    Surface surface = together(strip(40, 1), strip(41, 3));
    append_faces(surface, split(strip(30, 0)));
    append_faces(surface, split(box({3, 0, 0})));
    append_faces(surface, reversed(box({5, 0, 0})));
    for (std::size_t i = 0; i < surface.triangles.size(); i += 2)
        reverse_face(surface, i);
    BuildOptions options;
    options.grid.depth = 6;
    const Bytes expected = file_of(built(surface, options));
    for (unsigned seed = 0; seed < 5; ++seed) {
        options.threads = static_cast<int>(seed % 3) + 1;
        EXPECT_EQ(file_of(built(shuffled(surface, seed), options)), expected) << seed;
    }
}

TEST(Winding, AModelIsClosedIfAllOfItIs) {
    BuildOptions options;
    options.grid.depth = 6;
    const auto is_closed = [&](std::vector<Surface> surfaces) {
        BuildStatistics statistics;
        return value_of(build_model(std::move(surfaces), options, statistics)).parameters.closed;
    };
    Surface points = box({3, 0, 0});
    points.triangles.clear();
    EXPECT_TRUE(is_closed({box(), reversed(split(box({2, 0, 0})))}));
    EXPECT_FALSE(is_closed({box(), strip(12, 0)}));
    EXPECT_FALSE(is_closed({box(), points}));
    EXPECT_FALSE(is_closed({points}));
    Surface leaf = box();
    leaf.textures.push_back(
        {.width = 1, .height = 1, .texels = {{255, 255, 255, 255}}, .use = {.least_opacity = 0.5F}});
    leaf.texture_ids.assign(12, 0);
    leaf.texture_corners.resize(12);
    EXPECT_FALSE(is_closed({leaf}));
    leaf.textures[0].use.least_opacity = 0;
    EXPECT_TRUE(is_closed({leaf}));
}

} // namespace
