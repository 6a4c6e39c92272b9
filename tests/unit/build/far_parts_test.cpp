// Which far parts of a surface are strays, and which belong to the scene.
#include "pbm_build/grid/far_parts.h"
#include "unit/build/built_models.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace pbm;
using namespace pbm::build;
using pbm::test::built;

// A bowl of 20 x 20 vertices and a length of 1 at `corner`.
Surface bowl(glm::dvec3 corner = glm::dvec3(0)) {
    constexpr unsigned kSide = 20;
    Surface surface;
    for (unsigned i = 0; i < kSide; ++i)
        for (unsigned j = 0; j < kSide; ++j) {
            const double x = i / (kSide - 1.0), y = j / (kSide - 1.0);
            surface.positions.push_back(corner + glm::dvec3(x, y, x * x + y * y));
        }
    for (unsigned i = 0; i + 1 < kSide; ++i)
        for (unsigned j = 0; j + 1 < kSide; ++j) {
            const unsigned a = i * kSide + j, b = a + kSide;
            surface.triangles.insert(surface.triangles.end(), {{a, b, b + 1}, {a, b + 1, a + 1}});
        }
    return surface;
}

void add(Surface &to, const Surface &other) {
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    to.positions.insert(to.positions.end(), other.positions.begin(), other.positions.end());
    for (const glm::uvec3 &t : other.triangles)
        to.triangles.push_back(t + first);
}

Surface triangle(glm::dvec3 corner, double size) {
    Surface surface;
    surface.positions = {corner, corner + glm::dvec3(size, 0, 0), corner + glm::dvec3(0, size, 0)};
    surface.triangles = {{0, 1, 2}};
    return surface;
}

struct Outcome {
    bool ok = false;
    std::size_t faces = 0, points = 0, lines = 0;
    AttributeReport line{};
};

Outcome outcome_of(Surface surface, bool strict = false) {
    BuildStatistics statistics;
    const Status status = drop_far_parts(surface, strict, statistics);
    Outcome outcome{status.ok(), surface.triangles.size(), surface.point_count(), statistics.attributes.size(), {}};
    if (!status.ok())
        outcome.line.note = status.error().message;
    else if (outcome.lines > 0)
        outcome.line = statistics.attributes.front();
    return outcome;
}

TEST(FarParts, ASpikeToAStrayVertexIsDropped) {
    Surface surface = bowl();
    const std::size_t all = surface.triangles.size();
    surface.positions[47] = {300, -200, 1};
    const Outcome outcome = outcome_of(surface);
    EXPECT_EQ(outcome.faces, all - 6);
    ASSERT_EQ(outcome.lines, 1U);
    EXPECT_EQ(outcome.line.name, "outliers");
    EXPECT_EQ(outcome.line.fate, Fate::dropped);
    EXPECT_NE(outcome.line.note.find("6 faces far from all others"), std::string::npos) << outcome.line.note;
    EXPECT_NE(outcome.line.note.find("--keep-outliers keeps them"), std::string::npos);
    const Outcome strict = outcome_of(surface, true);
    EXPECT_FALSE(strict.ok);
    EXPECT_EQ(strict.faces, all);
    EXPECT_NE(strict.line.note.find("6 faces"), std::string::npos);
}

TEST(FarParts, SmallComponentsFarAwayAreDroppedAtAnyDistance) {
    Surface surface = bowl();
    const std::size_t all = surface.triangles.size();
    add(surface, triangle({30, 0, 0}, 0.1));
    add(surface, triangle({1e4, 1e4, 0}, 0.1));
    add(surface, triangle({0, 0, -1e30}, 1e29));
    const Outcome outcome = outcome_of(surface);
    EXPECT_EQ(outcome.faces, all);
    EXPECT_EQ(outcome.lines, 1U);
}

TEST(FarParts, AGroundPlaneStaysAndIsNamed) {
    Surface surface = bowl();
    const std::size_t all = surface.triangles.size();
    add(surface, triangle({-50, -50, 0}, 200));
    const Outcome unconnected = outcome_of(surface);
    EXPECT_EQ(unconnected.faces, all + 1);
    ASSERT_EQ(unconnected.lines, 1U);
    EXPECT_EQ(unconnected.line.fate, Fate::kept);
    Surface connected = bowl();
    connected.positions.insert(connected.positions.end(), {{-50, -50, 0}, {50, -50, 0}});
    connected.triangles.emplace_back(0, 400, 401);
    EXPECT_EQ(outcome_of(connected).faces, all + 1);
    EXPECT_EQ(outcome_of(connected).line.fate, Fate::kept);
    EXPECT_TRUE(outcome_of(connected, true).ok) << "nothing is dropped";
}

TEST(FarParts, DamagedCoordinatesAreDroppedWhateverTheirFaces) {
    Surface surface = bowl();
    const std::size_t all = surface.triangles.size();
    surface.positions[47] = {1e9, 0, 0};
    surface.positions[48] = {0, -1e9, 0}; // a neighbour
    EXPECT_EQ(outcome_of(surface).faces, all - 10);
}

TEST(FarParts, PartsThatMakeTheGridLessThanTenTimesLargerStay) {
    for (const double place : {17.8, 21.0}) { // the grid of the bowl is 2 long
        Surface surface = bowl();
        const std::size_t all = surface.triangles.size();
        add(surface, triangle({place, 0, 0}, 0.1));
        EXPECT_EQ(outcome_of(surface).faces, place < 20 ? all + 1 : all) << place;
    }
}

TEST(FarParts, AGroundPlaneThatMakesTheGridAThousandTimesLargerIsDamage) {
    for (const double half : {700.0, 1500.0}) {
        Surface surface = bowl();
        const std::size_t all = surface.triangles.size();
        add(surface, triangle({-half, -half, 0}, 2 * half));
        EXPECT_EQ(outcome_of(surface).faces, half < 1000 ? all + 1 : all) << half;
    }
}

TEST(FarParts, ATwentiethOfAllPointsIsAnObject) {
    for (const int far : {20, 24}) { // of 400 and these
        Surface points = bowl();
        points.triangles.clear();
        for (int i = 0; i < far; ++i)
            points.positions.emplace_back(500 + 0.01 * i, 0, 0);
        EXPECT_EQ(outcome_of(points).points, far == 20 ? 400U : 424U);
    }
}

TEST(FarParts, ObjectsFarApartAreNotCut) {
    Surface two = bowl();
    add(two, bowl({1000, 0, 0}));
    EXPECT_EQ(outcome_of(two).lines, 0U);
    Surface points = bowl();
    points.triangles.clear();
    for (int i = 0; i < 40; ++i) // a tenth
        points.positions.emplace_back(500 + 0.01 * i, 0, 0);
    EXPECT_EQ(outcome_of(points).lines, 0U);
    Surface chain = bowl();
    chain.triangles.clear();
    for (int i = 0; i < 15; ++i) // without a gap
        chain.positions.emplace_back(1.5 * std::pow(1.5, i), 0, 0);
    EXPECT_EQ(outcome_of(chain).points, 415U);
}

TEST(FarParts, AClusterOfStrayPointsIsDropped) {
    Surface points = bowl();
    points.triangles.clear();
    for (int i = 0; i < 16; ++i) // 4 %
        points.positions.emplace_back(500 + 0.01 * i, 0, 0);
    points.colours.resize(416);
    const Outcome outcome = outcome_of(points);
    EXPECT_EQ(outcome.points, 400U);
    EXPECT_NE(outcome.line.note.find("16 points far from all others"), std::string::npos);
}

TEST(FarParts, StrayPointsBesideFacesAreDropped) {
    Surface cloud = bowl({2, 0, 0});
    cloud.triangles.clear();
    cloud.positions.emplace_back(1e6, 0, 0);
    BuildOptions options;
    options.grid.depth = 6;
    BuildStatistics statistics, kept;
    const Model model = built(std::vector<Surface>{bowl(), cloud}, options, &statistics);
    EXPECT_LT(model.parameters.grid.edge(), 4);
    EXPECT_TRUE(std::any_of(statistics.attributes.begin(), statistics.attributes.end(), [](const auto &line) {
        return line.name == "outliers" && line.note.starts_with("1 point far from all others");
    }));
    options.outliers = Outliers::keep;
    EXPECT_GT(built(std::vector<Surface>{bowl(), cloud}, options, &kept).parameters.grid.edge(), 1e5);
}

} // namespace
