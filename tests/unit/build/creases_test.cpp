// Which normals the corners of faces have: smooth across gentle edges, apart at creases, flat on planes.
#include "pbm_build/surface/corner_normals.h"
#include "pbm_build/surface/creases.h"
#include "pbm_build/surface/face_normal.h"
#include "pbm_build/surface/vertex_normals.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using namespace pbm;
using namespace pbm::build;
using pbm::test::built;

using Corners = std::array<glm::dvec3, 3>;

// The unit normals of each triangle's corners; its own where a corner has none.
std::vector<Corners> corners_of(Surface &surface) {
    const VertexNormals normals = value_of(vertex_normals(surface, 2));
    std::vector<Corners> all;
    for (const glm::uvec3 &t : surface.triangles) {
        const glm::dvec3 own =
            glm::normalize(face_normal(surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]));
        Corners &corners = all.emplace_back();
        for (int corner = 0; corner < 3; ++corner) {
            const ShortNormal &n = normals.normals[t[corner]];
            corners[static_cast<std::size_t>(corner)] = is_zero(n) ? own : glm::normalize(glm::dvec3(n[0], n[1], n[2]));
        }
    }
    return all;
}

void add_quad(Surface &surface, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    surface.triangles.emplace_back(a, b, c);
    surface.triangles.emplace_back(a, c, d);
}

// A prism of `sides` around z, of radius 1 and height 2: its sides first, then its caps, each a fan from a corner.
Surface prism(unsigned sides) {
    Surface surface;
    const double step = 2 * std::acos(-1.0) / sides;
    for (unsigned i = 0; i < sides; ++i)
        for (const double z : {-1.0, 1.0})
            surface.positions.emplace_back(std::cos(step * i), std::sin(step * i), z);
    for (unsigned i = 0; i < sides; ++i) {
        const unsigned j = (i + 1) % sides;
        add_quad(surface, 2 * i, 2 * j, 2 * j + 1, 2 * i + 1);
    }
    for (unsigned i = 1; i + 1 < sides; ++i) {
        surface.triangles.emplace_back(0, 2 * i + 2, 2 * i);
        surface.triangles.emplace_back(1, 2 * i + 1, 2 * i + 3);
    }
    return surface;
}

// A sphere of `rings` x 2 `rings` quads whose radius varies at random, so that no two faces lie in a plane.
Surface rough_sphere(unsigned rings) {
    Surface surface;
    std::mt19937 random(1);
    const double pi = std::acos(-1.0);
    surface.positions = {{0, 0, 1}, {0, 0, -1}};
    for (unsigned i = 1; i < rings; ++i)
        for (unsigned j = 0; j < 2 * rings; ++j) {
            const double polar = pi * i / rings, around = pi * j / rings;
            const double radius = 1 + 0.01 * static_cast<double>(random() % 1000) / 1000;
            surface.positions.push_back(radius * glm::dvec3(std::sin(polar) * std::cos(around),
                                                            std::sin(polar) * std::sin(around), std::cos(polar)));
        }
    const auto at = [&](unsigned ring, unsigned j) { return 2 + (ring - 1) * 2 * rings + j % (2 * rings); };
    for (unsigned j = 0; j < 2 * rings; ++j) {
        surface.triangles.emplace_back(0, at(1, j), at(1, j + 1));
        surface.triangles.emplace_back(1, at(rings - 1, j + 1), at(rings - 1, j));
        for (unsigned i = 1; i + 1 < rings; ++i)
            add_quad(surface, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
    return surface;
}

// Within 0.05 degrees: what rounding to short normals leaves.
void expect_near(const glm::dvec3 &normal, const glm::dvec3 &expected) {
    EXPECT_GT(glm::dot(normal, glm::normalize(expected)), std::cos(glm::radians(0.05)));
}

TEST(CornerNormals, ACylinderIsRoundBetweenFlatCaps) {
    Surface surface = prism(24);
    const std::vector<Corners> corners = corners_of(surface);
    EXPECT_EQ(surface.positions.size(), 3 * 48U / 2 + 24U) << "each vertex has two normals";
    for (std::size_t i = 0; i < corners.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const glm::dvec3 &place = surface.positions[surface.triangles[i][static_cast<int>(c)]];
            const bool side = i < 48;
            expect_near(corners[i][c], side ? glm::dvec3(place.x, place.y, 0) : glm::dvec3(0, 0, place.z));
        }
}

TEST(CornerNormals, TheSidesOfAHexagonAreFlatUpToTheirEdges) {
    for (const unsigned sides : {4U, 6U, 8U}) {
        Surface surface = prism(sides);
        const std::vector<Corners> corners = corners_of(surface);
        for (std::size_t i = 0; i < corners.size(); ++i) {
            expect_near(corners[i][0], corners[i][1]); // equal but for rounding
            expect_near(corners[i][0], corners[i][2]);
        }
    }
}

TEST(CornerNormals, ALargePlaneStaysFlatWhereItMeetsAFillet) {
    // A plate whose end bends down along four narrow strips of 10 degrees each.
    Surface surface;
    glm::dvec3 at(0);
    for (int i = 0; i <= 5; ++i) {
        surface.positions.push_back(at);
        surface.positions.push_back(at + glm::dvec3(0, 1, 0));
        const double down = glm::radians(10.0 * i);
        at += (i == 0 ? 1.0 : 0.02) * glm::dvec3(std::cos(down), 0, -std::sin(down));
    }
    for (unsigned i = 0; i < 5; ++i)
        add_quad(surface, 2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1);
    const std::vector<Corners> corners = corners_of(surface);
    for (std::size_t face = 0; face < 2; ++face)
        for (const glm::dvec3 &normal : corners[face])
            EXPECT_EQ(normal, glm::dvec3(0, 0, 1));
    expect_near(corners[2][0], {0, 0, 1}); // the fillet begins where the plate ends
    expect_near(corners[2][1], {std::sin(glm::radians(15.0)), 0, std::cos(glm::radians(15.0))});
}

TEST(CornerNormals, AScanIsSmoothExceptAtSharpEdges) {
    Surface surface = rough_sphere(20);
    const std::size_t vertices = surface.positions.size();
    const std::vector<Corners> corners = corners_of(surface);
    EXPECT_EQ(surface.positions.size(), vertices) << "no vertex is split";
    for (std::size_t i = 0; i < corners.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_GT(
                glm::dot(corners[i][c], glm::normalize(surface.positions[surface.triangles[i][static_cast<int>(c)]])),
                0.98);
    Surface cut = rough_sphere(20);
    for (glm::dvec3 &p : cut.positions)
        p.z = std::max(p.z, 0.0); // folded: the rim is a right angle
    std::size_t facing_down = 0;
    for (const Corners &normals : corners_of(cut))
        for (const glm::dvec3 &normal : normals) {
            EXPECT_TRUE(normal.z < -0.999 || normal.z > -0.05) << normal.z;
            facing_down += normal.z < -0.999 ? 1 : 0;
        }
    EXPECT_GT(facing_down, 1000U);
}

TEST(CornerNormals, TheAngleDecides) {
    const auto normals_of_cube = [](double degrees) {
        Surface cube = prism(4);
        cube.crease_angle = glm::radians(degrees);
        const std::vector<Corners> corners = corners_of(cube);
        return std::pair(cube.positions.size(), corners.front().front());
    };
    EXPECT_EQ(normals_of_cube(0).first, 8U) << "the faces have no vertex normals: each has its own";
    EXPECT_EQ(normals_of_cube(90).first, 24U) << "an edge of exactly this angle is a crease";
    EXPECT_EQ(normals_of_cube(91).first, 8U);
    expect_near(normals_of_cube(0).second, {1, 1, 0});
    expect_near(normals_of_cube(90).second, {1, 1, 0});
    expect_near(normals_of_cube(180).second, {std::sqrt(2), 0, -1}); // planes count once, so all three sides the same
}

TEST(CornerNormals, SmoothingGroupsDecide) {
    Surface one = prism(4), sides = prism(4), flat = prism(24);
    one.smoothing_groups.assign(one.triangles.size(), 7);
    expect_near(corners_of(one).front().front(), {std::sqrt(2), 0, -1});
    EXPECT_EQ(one.positions.size(), 8U) << "all edges are smooth";
    sides.smoothing_groups.assign(8, 1);
    sides.smoothing_groups.resize(sides.triangles.size(), 2);
    const std::vector<Corners> corners = corners_of(sides);
    EXPECT_EQ(sides.positions.size(), 16U) << "creases between the sides and the caps alone";
    expect_near(corners.front().front(), {1, 0, 0}); // between two sides, turned by 45 degrees
    expect_near(corners.back().front(), {0, 0, 1});
    flat.smoothing_groups.assign(48, Surface::kFlat);
    flat.smoothing_groups.resize(flat.triangles.size(), 0); // the caps, by the angle
    for (const Corners &face : corners_of(flat))
        for (const glm::dvec3 &normal : face)
            expect_near(normal, face[0]);
    Surface by_angle = prism(24);
    const glm::dvec3 turned = corners_of(by_angle).front().front() - corners_of(flat).front().front();
    EXPECT_GT(glm::length(turned), 0.1) << "sides of 15 degrees are smooth without groups";
    Surface seam; // wound against each other
    seam.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    seam.triangles = {{0, 1, 2}, {0, 3, 2}};
    seam.smoothing_groups = {1, 1};
    const std::vector<Corners> apart = corners_of(seam);
    expect_near(apart[0][0], {0, 0, 1});
    expect_near(apart[1][0], {0, 0, -1});
    BuildStatistics said;
    choose_creases(sides, 30, 2, said);
    EXPECT_TRUE(sides.smoothing_groups.empty()) << "--crease-angle overrules them";
}

TEST(CornerNormals, GivenNormalsWin) {
    Surface surface = prism(4);
    surface.normals.assign(8, glm::vec3(0, 0, 2));
    surface.normals[3] = glm::vec3(0);
    const std::vector<Corners> corners = corners_of(surface);
    EXPECT_EQ(surface.positions.size(), 10U) << "only the vertex without a normal is split";
    for (std::size_t i = 0; i < corners.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            if (const std::uint32_t vertex = surface.triangles[i][static_cast<int>(c)]; vertex < 8 && vertex != 3) {
                EXPECT_EQ(corners[i][c], glm::dvec3(0, 0, 1));
            }
}

TEST(CornerNormals, EachFaceAtAConesTipHasItsOwn) {
    Surface cone;
    constexpr unsigned kSides = 1000; // beyond kMaxFacesAtVertex
    cone.positions = {{0, 0, 1}, {0, 0, 0}};
    for (unsigned i = 0; i < kSides; ++i) {
        const double around = 2 * std::acos(-1.0) * i / kSides;
        cone.positions.emplace_back(std::cos(around), std::sin(around), 0);
        cone.triangles.emplace_back(0, 2 + i, 2 + (i + 1) % kSides);
        cone.triangles.emplace_back(1, 2 + (i + 1) % kSides, 2 + i);
    }
    const std::vector<Corners> corners = corners_of(cone);
    for (unsigned i = 0; i < kSides; ++i) {
        const double around = 2 * std::acos(-1.0) * (i + 0.5) / kSides;
        expect_near(corners[2 * i][0], {std::cos(around), std::sin(around), 1});
        expect_near(corners[2 * i + 1][0], {0, 0, -1});
    }
    EXPECT_LT(cone.positions.size(), 2 + 3 * kSides + 10) << "the middle of the base needs no copies";
}

TEST(CornerNormals, TheOrderOfFacesChangesNothing) {
    std::mt19937 random(2);
    for (const Surface &surface : {prism(24), rough_sphere(12)}) {
        Surface other = surface;
        std::shuffle(other.triangles.begin(), other.triangles.end(), random);
        for (glm::uvec3 &t : other.triangles)
            t = {t.y, t.z, t.x};
        BuildOptions options;
        options.grid.depth = 6;
        EXPECT_EQ(built(surface, options).levels, built(other, options).levels);
    }
}

TEST(Creases, AnStlKeepsItsFacetsIfTheyAreFewOrPlanar) {
    const auto angle_of = [](Surface surface, std::optional<double> requested, BuildStatistics &statistics) {
        surface.has_facets = true;
        choose_creases(surface, requested, 2, statistics);
        return surface.crease_angle;
    };
    BuildStatistics few, planar, scan, asked;
    EXPECT_EQ(angle_of(rough_sphere(10), {}, few), 0.0);
    ASSERT_EQ(few.attributes.size(), 1U);
    EXPECT_NE(few.attributes.front().note.find("--crease-angle 44"), std::string::npos);
    EXPECT_EQ(angle_of(prism(3000), {}, planar), 0.0);
    EXPECT_EQ(angle_of(rough_sphere(40), {}, scan), std::nullopt);
    ASSERT_EQ(scan.attributes.size(), 1U);
    EXPECT_NE(scan.attributes.front().note.find("shaded smoothly, as a scan"), std::string::npos);
    EXPECT_EQ(angle_of(prism(6), 180, asked), glm::radians(180.0));
    EXPECT_TRUE(asked.attributes.empty());
}

TEST(Creases, ARequestWithoutEffectIsNamed) {
    Surface cloud = rough_sphere(10), declared = prism(6);
    cloud.triangles.clear();
    declared.normals.assign(declared.positions.size(), glm::vec3(1, 0, 0));
    for (Surface *surface : {&cloud, &declared}) {
        BuildStatistics statistics;
        choose_creases(*surface, 30, 2, statistics);
        ASSERT_EQ(statistics.attributes.size(), 1U);
        EXPECT_EQ(statistics.attributes.front().fate, Fate::dropped);
    }
}

TEST(Creases, FacetsStayFlatBesideASmoothScanAndPoints) {
    Surface facets = rough_sphere(10), scan = rough_sphere(40), cloud = rough_sphere(10);
    cloud.triangles.clear();
    facets.has_facets = true;
    for (glm::dvec3 &p : facets.positions)
        p.x += 3;
    for (glm::dvec3 &p : cloud.positions)
        p.x -= 3;
    BuildOptions options;
    options.grid.depth = 8;
    const auto planes_of = [&](const Model &model) {
        std::vector<std::uint16_t> normals = model.levels.back().points.normals;
        std::sort(normals.begin(), normals.end());
        return std::unique(normals.begin(), normals.end()) - normals.begin();
    };
    const auto together = planes_of(built(std::vector<Surface>{facets, scan, cloud}, options));
    facets.has_facets = false;
    EXPECT_LT(together + 500, planes_of(built(std::vector<Surface>{facets, scan, cloud}, options)))
        << "360 facets have few normals";
}

} // namespace
