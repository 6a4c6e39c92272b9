// Neighbour searches and their users, against comparing all pairs.
#include "pbm_build/neighbours/distinct_points.h"
#include "pbm_build/neighbours/near_voxels.h"
#include "pbm_build/neighbours/outliers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <tuple>

namespace pbm::build {
namespace {

double squared_distance(const LatticePoint &a, const LatticePoint &b) {
    const glm::dvec3 d(a - b);
    return (d.x * d.x + d.y * d.y) + d.z * d.z;
}

std::vector<NearPoint> nearest_of_all(const std::vector<LatticePoint> &points, std::size_t point, std::size_t most) {
    std::vector<NearPoint> all;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (i != point)
            all.push_back({static_cast<std::uint32_t>(i), squared_distance(points[i], points[point])});
    const auto key = [&](const NearPoint &p) {
        const LatticePoint &at = points[p.point];
        return std::tuple(p.squared_distance, at.z, at.y, at.x, p.point);
    };
    const std::size_t kept = std::min(most, all.size());
    std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(kept), all.end(),
                      [&](const NearPoint &a, const NearPoint &b) { return key(a) < key(b); });
    all.resize(kept);
    return all;
}

bool same(const NearPoint &a, const NearPoint &b) {
    return a.point == b.point && a.squared_distance == b.squared_distance;
}

// Points in a cube of edge `edge`. In a small cube many points coincide or lie at equal distances.
std::vector<LatticePoint> random_points(std::size_t count, int edge, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<LatticePoint> points;
    for (std::size_t i = 0; i < count; ++i) {
        const auto coordinate = [&] { return static_cast<int>(random() % static_cast<unsigned>(edge)); };
        const int x = coordinate(), y = coordinate(), z = coordinate();
        points.emplace_back(x, y, z);
    }
    return points;
}

void along_the_curve(std::vector<LatticePoint> &points) {
    std::sort(points.begin(), points.end(), [](const LatticePoint &a, const LatticePoint &b) {
        return code_of({a.x >> 9, a.y >> 9, a.z >> 9}) < code_of({b.x >> 9, b.y >> 9, b.z >> 9});
    });
}

TEST(PointNeighbours, AreThoseThatComparingAllFinds) {
    for (const int edge : {3, 40, 1 << 20, 1 << 30})
        for (const std::size_t count : {1U, 2U, 9U, 16U, 17U, 33U, 300U, 5000U})
            for (const bool in_order : {false, true}) {
                std::vector<LatticePoint> points = random_points(count, edge, static_cast<unsigned>(count));
                if (in_order)
                    along_the_curve(points);
                const PointNeighbours neighbours(points);
                for (const std::size_t most : {1U, 8U, 30U}) {
                    NeighbourCursor cursor(neighbours);
                    for (std::size_t i = 0; i < count; i += 1 + count / 40) {
                        std::vector<NearPoint> found(most), in_order_found(most);
                        found.resize(cursor.nearest(i, found));
                        const std::vector<NearPoint> expected = nearest_of_all(points, i, most);
                        ASSERT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end(), same))
                            << count << " points in " << edge << ", point " << i;
                        in_order_found.resize(cursor.nearest_in_order(i, in_order_found));
                        for (std::size_t k = 0; k < in_order_found.size(); ++k)
                            ASSERT_GE(in_order_found[k].squared_distance, found[k].squared_distance);
                    }
                }
            }
}

// More points at one distance than a search holds at once, and more near points than the one before has.
TEST(PointNeighbours, AreThoseThatComparingAllFindsAroundTheCentreOfASphere) {
    constexpr std::array<std::array<int, 3>, 4> kTriples{{{0, 0, 15}, {2, 5, 14}, {2, 10, 11}, {0, 9, 12}}};
    std::vector<LatticePoint> points{{100, 100, 100}, {5000, 0, 0}, {0, 100000, 0}};
    for (int x = -15; x <= 15; ++x)
        for (int y = -15; y <= 15; ++y)
            for (int z = -15; z <= 15; ++z) {
                std::array<int, 3> sizes{std::abs(x), std::abs(y), std::abs(z)};
                std::sort(sizes.begin(), sizes.end());
                if (std::find(kTriples.begin(), kTriples.end(), sizes) != kTriples.end())
                    points.emplace_back(100 + x, 100 + y, 100 + z);
            }
    ASSERT_GT(points.size(), Candidates::kRoom);
    const PointNeighbours neighbours(points);
    NeighbourCursor cursor(neighbours);
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::vector<NearPoint> found(20);
        found.resize(cursor.nearest(i, found));
        const std::vector<NearPoint> expected = nearest_of_all(points, i, 20);
        ASSERT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end(), same)) << i;
    }
}

// A bumpy sheet: most voxels have near neighbours; one voxel is far from all others.
std::vector<MortonCode> sheet(int depth, std::uint32_t step) {
    const std::uint32_t edge = 1U << depth;
    std::set<MortonCode> codes{morton_encode(edge - 1, edge - 1, edge - 1)};
    for (std::uint32_t y = 0; y < edge; y += step)
        for (std::uint32_t x = 0; x < edge; x += step)
            codes.insert(morton_encode(x, y, (x * y / 7 + x) % 5 % edge));
    return {codes.begin(), codes.end()};
}

TEST(NearVoxels, AreThoseThatComparingAllFinds) {
    for (const int depth : {2, 3, 5, 7})
        for (const std::uint32_t step : {1U, 2U, 5U}) {
            const std::vector<MortonCode> codes = sheet(depth, step);
            std::vector<LatticePoint> places;
            for (const MortonCode code : codes) {
                const auto v = morton_decode(code);
                places.emplace_back(v[0], v[1], v[2]);
            }
            const NearVoxels voxels(codes, depth);
            NearVoxelCursor cursor(voxels);
            for (std::size_t i = 0; i < codes.size(); i += 1 + codes.size() / 400) {
                std::array<Neighbour, 12> room;
                const auto found = std::span(room).first(cursor.nearest(i, room));
                const std::vector<NearPoint> expected = nearest_of_all(places, i, room.size());
                ASSERT_EQ(found.size(), expected.size());
                for (std::size_t k = 0; k < found.size(); ++k) {
                    ASSERT_EQ(found[k].voxel, expected[k].point);
                    ASSERT_EQ(found[k].squared_distance, expected[k].squared_distance);
                    ASSERT_EQ(places[found[k].voxel], places[i] + found[k].offset);
                }
                constexpr int kWithin = 12;
                std::vector<NearPoint> all = nearest_of_all(places, i, 256);
                std::erase_if(all, [&](const NearPoint &near) { return near.squared_distance > kWithin; });
                const auto within = cursor.within(i, kWithin);
                ASSERT_EQ(within.size(), all.size());
                for (const Neighbour &near : within) {
                    ASSERT_LE(near.squared_distance, kWithin);
                    ASSERT_EQ(places[near.voxel], places[i] + near.offset);
                }
            }
        }
}

// The rule of outliers.h, evaluated directly on the spacings of all points.
Bytes outliers_of_all(const std::vector<LatticePoint> &points) {
    std::vector<std::vector<NearPoint>> near;
    std::vector<float> spacing;
    for (std::size_t i = 0; i < points.size(); ++i) {
        near.push_back(nearest_of_all(points, i, kSpacingNeighbours));
        double sum = 0;
        for (const NearPoint &p : near.back())
            sum += std::sqrt(p.squared_distance);
        spacing.push_back(static_cast<float>(sum / static_cast<double>(kSpacingNeighbours)));
    }
    const auto median = [](std::vector<float> values) {
        std::sort(values.begin(), values.end());
        return static_cast<double>(values[values.size() / 2]);
    };
    const double usual = median(spacing);
    Bytes outliers;
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::vector<float> theirs;
        for (const NearPoint &p : near[i])
            theirs.push_back(spacing[p.point]);
        const auto own = static_cast<double>(spacing[i]);
        outliers.push_back(own > 4 * median(theirs) && own > 4 * usual ? 1 : 0);
    }
    return outliers;
}

TEST(Outliers, HaveMoreThanFourTimesTheUsualSpacing) {
    std::vector<float> spacings(100, 1);
    spacings[40] = 4;
    spacings[50] = 4.1F;
    std::vector<std::uint32_t> nearest; // the first eight points are the neighbours of all
    for (std::size_t i = 0; i < spacings.size(); ++i)
        for (std::uint32_t k = 0; k < kSpacingNeighbours; ++k)
            nearest.push_back(k);
    Bytes expected(spacings.size(), 0);
    expected[50] = 1;
    EXPECT_EQ(find_outliers(spacings, nearest), expected);
}

TEST(Outliers, AreThoseThatSpacingsOfAllPointsName) {
    // A dense and a sparse region without outliers, and five stray points, three of them close together.
    std::mt19937 random(3);
    std::vector<LatticePoint> points;
    const auto scatter = [&](int count, int from, int size) {
        for (int i = 0; i < count; ++i) {
            const auto coordinate = [&] { return static_cast<int>(random() % static_cast<unsigned>(size)); };
            const int x = coordinate(), y = coordinate();
            points.emplace_back(from + x, y, (x + y) / 8);
        }
    };
    scatter(3000, 0, 100000);
    scatter(300, 200000, 300000);
    for (const int x : {600000, 600100, 600200, 900000, 2000000})
        points.emplace_back(x, x, 500000);
    for (const bool in_order : {false, true}) {
        if (in_order)
            along_the_curve(points);
        const Bytes expected = outliers_of_all(points);
        const PointNeighbours neighbours(points);
        EXPECT_GE(std::count(expected.begin(), expected.end(), 1), 2);
        EXPECT_LT(std::count(expected.begin(), expected.end(), 1), 100);
        EXPECT_EQ(find_outliers(neighbours, 1), expected);
        EXPECT_EQ(find_outliers(neighbours, 4), expected);
        std::vector<float> spacings;
        std::vector<std::uint32_t> nearest;
        for (std::size_t i = 0; i < points.size(); ++i) {
            double sum = 0;
            for (const NearPoint &near : nearest_of_all(points, i, kSpacingNeighbours)) {
                sum += std::sqrt(near.squared_distance);
                nearest.push_back(near.point);
            }
            spacings.push_back(static_cast<float>(sum / static_cast<double>(kSpacingNeighbours)));
        }
        EXPECT_EQ(find_outliers(spacings, nearest), expected);
    }
}

TEST(DistinctPoints, LieAlongTheCurveWhateverTheirOrder) {
    constexpr int kDepth = 16;
    const Grid grid{.depth = kDepth, .voxel_size = kLatticeSteps}; // a lattice step has length 1
    std::vector<glm::dvec3> positions;
    for (const int edge : {5, 1000, 1 << 29}) // small edges: many points in one cell of the first sort, or coincident
        for (const LatticePoint &p : random_points(2000, edge, 7))
            positions.emplace_back(p);
    const DistinctPoints points = distinct_points(positions, grid, 1);
    for (std::size_t i = 1; i < points.at.size(); ++i) {
        const auto code = [](const LatticePoint &p) { return code_of({p.x >> 9, p.y >> 9, p.z >> 9}); };
        const LatticePoint &a = points.at[i - 1], &b = points.at[i];
        const auto key = [&](const LatticePoint &p) {
            return std::array<std::int64_t, 4>{static_cast<std::int64_t>(code(p)), p.x, p.y, p.z};
        };
        ASSERT_LE(key(a), key(b));
    }
    for (std::size_t i = 0; i < positions.size(); ++i)
        ASSERT_EQ(glm::dvec3(points.at[points.place_of[i]]), positions[i]);
    std::vector<glm::dvec3> shuffled = positions;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(5));
    EXPECT_EQ(distinct_points(shuffled, grid, 2).at, points.at);
}

} // namespace
} // namespace pbm::build
