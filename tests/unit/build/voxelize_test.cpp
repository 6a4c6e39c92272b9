#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/lattice/lattice_triangle.h"
#include "pbm_build/lattice/radix_sort.h"
#include "pbm_build/radii/splat_radius.h"
#include "pbm_build/radii/tangent_cell.h"
#include "pbm_build/surface/short_normal.h"
#include "pbm_build/voxels/sample_points.h"
#include "pbm_build/voxels/triangle_columns.h"
#include "pbm_build/voxels/triangle_mix.h"
#include "pbm_build/voxels/triangle_voxels.h"
#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/hashes/hash.h"
#include "system/threads/cancellation.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <csignal>
#include <map>
#include <random>
#include <set>

#include <sys/time.h>

namespace {

using namespace pbm;
using namespace pbm::build;

VoxelSums sums_of(const std::vector<Sample> &samples) {
    VoxelSums sums;
    for (const Sample &sample : samples) {
        sums.add_normal({sample.normal[0], sample.normal[1], sample.normal[2]}, sample.rest.two_sided);
        sums.add_colour({sample.colour[0], sample.colour[1], sample.colour[2]});
        sums.add_rest(sample.rest);
    }
    return sums;
}

// BVG.md has no rule for it: voxel_sums.h says that half of the votes suffice.
TEST(VoxelSums, HalfOfTheVotesMakeAVoxelTwoSided) {
    const std::array<std::int32_t, 3> up{0, 0, static_cast<std::int32_t>(kNormalScale)};
    const auto is_two_sided = [&](int two_sided, int one_sided) {
        VoxelSums sums;
        for (int i = 0; i < two_sided + one_sided; ++i)
            sums.add_normal(up, i < two_sided);
        return (mean_normal(sums) & kTwoSidedBit) != 0;
    };
    EXPECT_FALSE(is_two_sided(0, 1));
    EXPECT_TRUE(is_two_sided(1, 0));
    EXPECT_TRUE(is_two_sided(1, 1));
    EXPECT_FALSE(is_two_sided(1, 2));
    EXPECT_TRUE(is_two_sided(2, 2));
    EXPECT_FALSE(is_two_sided(2, 3));
}

TEST(VoxelSums, AWallIsThinIfItsNormalsCancelToLessThanHalf) {
    const auto scale = static_cast<std::int32_t>(kNormalScale);
    const auto is_thin = [&](int up, int down, std::int32_t more) {
        VoxelSums sums;
        for (int i = 0; i < up + down; ++i)
            sums.add_normal({0, 0, i < up ? scale : -scale}, false);
        sums.normal[2] += more;
        return sums.is_thin();
    };
    EXPECT_FALSE(is_thin(1, 0, 0));
    EXPECT_TRUE(is_thin(1, 1, 0));
    EXPECT_FALSE(is_thin(3, 1, 0)) << "the sum is exactly half of the votes";
    EXPECT_TRUE(is_thin(3, 1, -1));
}

// 10 is the largest linear value nearest to sRGB 0: BVG.md 6.3.3.
TEST(VoxelSums, MeanColoursRoundHalvesUp) {
    const auto mean = [](std::uint64_t sum, std::uint32_t samples) {
        VoxelSums sums;
        sums.colour = {sum, sum, sum};
        sums.samples = samples;
        return sums.mean_colour();
    };
    EXPECT_EQ(mean(20, 2), (Rgb8{0, 0, 0}));
    EXPECT_EQ(mean(21, 2), (Rgb8{1, 1, 1}));
    EXPECT_EQ(mean(31, 3), (Rgb8{0, 0, 0}));
    EXPECT_EQ(mean(32, 3), (Rgb8{1, 1, 1}));
}

std::uint16_t mean_normal_of(const std::vector<Sample> &samples) {
    const VoxelSums sums = sums_of(samples);
    if (!sums.is_thin())
        return mean_normal(sums);
    PlaneSums plane;
    for (const Sample &sample : samples)
        plane.add({sample.normal[0], sample.normal[1], sample.normal[2]});
    return plane_normal(plane);
}

Sample with_normal(double x, double y, double z) { return {.normal = to_short_normal({x, y, z})}; }

using VoxelSet = std::set<std::array<int, 3>>;

VoxelSet voxels_of(const std::array<glm::dvec3, 3> &corners, int depth_axis) {
    VoxelSet voxels;
    visit_voxels(corners, depth_axis, [&](MortonCode code) {
        const auto v = morton_decode(code);
        voxels.insert({static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2])});
    });
    return voxels;
}

using Weights = std::array<double, 3>;

// Barycentric weights of the point of the triangle that is nearest to `p`.
Weights nearest_weights(const std::array<glm::dvec3, 3> &corners, const glm::dvec3 &p) {
    TriangleMix triangle;
    triangle.set_corners(corners);
    MixedRows rows;
    triangle.mix(p, 0, 1, rows);
    return {rows.weights[0][0], rows.weights[1][0], rows.weights[2][0]};
}

// Calls `same` once for each SIMD target that this processor supports.
template <class Function> void for_every_target(const Function &same) {
    int tried = 0;
    for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1, ++tried) {
        hwy::SetSupportedTargetsForTest(targets & -targets);
        same(hwy::TargetName(targets & -targets));
    }
    hwy::SetSupportedTargetsForTest(0);
    EXPECT_GT(tried, 0);
}

TEST(Average, NormalsAreSummed) {
    EXPECT_EQ(mean_normal_of({with_normal(1, 0, 0), with_normal(0, 3, 0)}), quantise_normal(1, 1, 0));
    EXPECT_EQ(mean_normal_of({with_normal(0, 0, 1), with_normal(0, 0, 0)}), quantise_normal(0, 0, 1));
    EXPECT_EQ(mean_normal_of({with_normal(0, 0, 0)}), kNoNormal);
}

TEST(Average, CancellingNormalsBecomeTheTwoSidedNormalOfTheirPlane) {
    EXPECT_EQ(mean_normal_of({with_normal(0, 0, 1), with_normal(0, 0, -1)}), quantise_normal(0, 0, 1) | kTwoSidedBit);
    EXPECT_EQ(mean_normal_of({with_normal(-3, 0, 1), with_normal(3, 0, -1)}), quantise_normal(3, 0, -1) | kTwoSidedBit);
    // 100 degrees apart: the sum is 0.64 of the votes
    EXPECT_EQ(mean_normal_of({with_normal(0.766, 0.643, 0), with_normal(-0.766, 0.643, 0)}) & kTwoSidedBit, 0);
    // 130 degrees: 0.42 of the votes
    EXPECT_NE(mean_normal_of({with_normal(0.906, 0.423, 0), with_normal(-0.906, 0.423, 0)}) & kTwoSidedBit, 0);
}

TEST(Average, ColoursAreAveragedInLinearLight) {
    EXPECT_EQ(sums_of({{.colour = {0, 0, 65535}}, {.colour = {65535, 0, 65535}}}).mean_colour(), (Rgb8{188, 0, 255}));
    for (unsigned c = 0; c < 256; ++c) {
        const std::uint16_t linear = linear_table()[c];
        EXPECT_EQ(sums_of({{.colour = {linear, linear, linear}}}).mean_colour()[0], c);
    }
}

TEST(Average, MaterialsGoByMajorityAndTheLargestRadiusWins) {
    EXPECT_EQ(sums_of({{.rest = {.radius = 7}}, {.rest = {.radius = 9}}, {.rest = {.radius = 1}}}).radius, 9);
    EXPECT_EQ(majority({0, 0, 1, 0, 0, 2, 0, 0}), 5);
    EXPECT_EQ(majority({0, 0, 0, 1, 0, 0, 1, 0}), 3) << "a tie goes to the lowest index";
}

TEST(ShortNormal, ManyAreRoundedAsOneIs) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-1e6, 1e6);
    NormalColumns columns;
    for (int round = 0; round < 100; ++round) {
        for (std::size_t row = 0; row < NormalColumns::kRows; ++row) {
            for (std::size_t axis = 0; axis < 3; ++axis)
                columns.from[axis][row] = row % 7 == 0 ? 0 : row % 5 == 0 ? 100 * double(axis) - 100 : place(random);
            columns.is_rounded[row] = row % 5 == 0 ? 1 : 0;
        }
        columns.round();
        for (std::size_t row = 0; row < NormalColumns::kRows; ++row) {
            const glm::dvec3 v(columns.from[0][row], columns.from[1][row], columns.from[2][row]);
            const ShortNormal one = to_short_normal(v);
            for (int axis = 0; axis < 3; ++axis) {
                const auto k = static_cast<std::size_t>(axis);
                ASSERT_EQ(columns.rounded[k][row], columns.is_rounded[row] > 0 ? static_cast<int>(v[axis]) : one[k]);
            }
        }
    }
}

TEST(TriangleVoxels, EveryPointOfATriangleLiesInAVoxelThatIsVisited) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(0, 12), weight(0, 1);
    for (int round = 0; round < 300; ++round) {
        std::array<glm::dvec3, 3> corners;
        for (glm::dvec3 &corner : corners)
            corner = {place(random), place(random), place(random)};
        if (round % 3 == 0) // a sliver
            corners[2] = corners[0] + (corners[1] - corners[0]) * weight(random) + 1e-3;
        const glm::dvec3 u = corners[1] - corners[0], v = corners[2] - corners[0];
        const glm::dvec3 n(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
        const int axis = std::fabs(n.x) > std::fabs(n.y) ? (std::fabs(n.x) > std::fabs(n.z) ? 0 : 2)
                                                         : (std::fabs(n.y) > std::fabs(n.z) ? 1 : 2);
        const VoxelSet voxels = voxels_of(corners, axis);
        for (int i = 0; i < 1000; ++i) {
            double a = weight(random), b = weight(random);
            if (a + b > 1) {
                a = 1 - a;
                b = 1 - b;
            }
            const glm::dvec3 p = corners[0] + a * u + b * v;
            ASSERT_TRUE(voxels.contains({static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)}));
        }
        for (const auto &voxel : voxels) { // and no voxel that it does not touch
            const glm::dvec3 centre(voxel[0] + 0.5, voxel[1] + 0.5, voxel[2] + 0.5);
            const auto w = nearest_weights(corners, centre);
            const glm::dvec3 off = corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2] - centre;
            ASSERT_LT(off.x * off.x + off.y * off.y + off.z * off.z, 0.75 + 1e-9);
        }
    }
}

TEST(TriangleVoxels, TouchingAVoxelFromOutsideDoesNotCount) {
    EXPECT_EQ(voxels_of({{{1, 1, 3}, {2, 1, 3}, {2, 2, 3}}}, 2), (VoxelSet{{1, 1, 3}}));
    EXPECT_EQ(voxels_of({{{1, 1, 2.5}, {2, 1, 3}, {2, 2, 3}}}, 2), (VoxelSet{{1, 1, 2}}));
}

TEST(TriangleVoxels, TheNearestPointIsFoundInEveryRegion) {
    const std::array<glm::dvec3, 3> t{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}};
    EXPECT_EQ(nearest_weights(t, {-1, -1, 5}), (Weights{1, 0, 0}));
    EXPECT_EQ(nearest_weights(t, {5, -1, 1}), (Weights{0, 1, 0}));
    EXPECT_EQ(nearest_weights(t, {-1, 5, 1}), (Weights{0, 0, 1}));
    EXPECT_EQ(nearest_weights(t, {1, -1, 1}), (Weights{0.5, 0.5, 0}));
    EXPECT_EQ(nearest_weights(t, {2, 2, 1}), (Weights{0, 0.5, 0.5}));
    EXPECT_EQ(nearest_weights(t, {0.5, 0.5, -3}), (Weights{0.5, 0.25, 0.25}));
}

// Where the fast path for small triangles finds voxels, they equal those of cutting, for any order of the corners.
TEST(TriangleVoxels, SmallTrianglesAreFoundAsCutOnesAre) {
    std::mt19937 random(1);
    int found = 0, slivers_found = 0;
    constexpr int kRounds = 4000;
    for (int round = 0; round < kRounds; ++round) {
        const int size = (1 << kLatticeBits) * (1 + round % 16) - 2, far = round % 2 == 0 ? 0 : 65000 << kLatticeBits;
        std::uniform_int_distribution<int> place(1, size);
        std::array<LatticePoint, 3> corners;
        for (LatticePoint &corner : corners)
            corner = LatticePoint(place(random), place(random), place(random)) + far;
        const bool sliver = round % 5 == 0;
        if (sliver)
            corners[2] = corners[0] + (corners[1] - corners[0]) / 3 + 1;
        if (round % 7 == 0) // parallel to an axis, with corners near voxel borders
            corners[1] = {corners[0].x, corners[0].y + (3 << kLatticeBits), corners[0].z};
        const glm::dvec3 n = lattice_normal(corners[0], corners[1], corners[2]);
        const int axis = std::fabs(n.x) >= std::fabs(n.y) ? (std::fabs(n.x) >= std::fabs(n.z) ? 0 : 2)
                                                          : (std::fabs(n.y) >= std::fabs(n.z) ? 1 : 2);
        sort_three(corners, before<LatticePoint>);
        std::vector<MortonCode> expected;
        visit_voxels({in_voxels(corners[0]), in_voxels(corners[1]), in_voxels(corners[2])}, axis,
                     [&](MortonCode code) { expected.push_back(code); });
        SmallTriangleCodes codes;
        const std::size_t count = find_small_triangle(corners, n, axis, codes);
        std::swap(corners[0], corners[static_cast<std::size_t>(1 + round % 2)]);
        SmallTriangleCodes again;
        ASSERT_EQ(find_small_triangle(corners, -n, axis, again), count);
        if (count == 0)
            continue;
        ++found;
        slivers_found += sliver ? 1 : 0;
        ASSERT_EQ(std::vector<MortonCode>(codes.begin(), codes.begin() + static_cast<std::ptrdiff_t>(count)), expected);
        ASSERT_TRUE(std::equal(codes.begin(), codes.begin() + static_cast<std::ptrdiff_t>(count), again.begin()));
    }
    EXPECT_GT(found, kRounds * 3 / 4);
    EXPECT_GT(slivers_found, kRounds / 10);
}

TEST(TriangleVoxels, CloseCallsAndLargeTrianglesAreLeftToTheCut) {
    constexpr int kVoxel = 1 << kLatticeBits;
    SmallTriangleCodes codes;
    const auto find = [&](const LatticePoint &a, const LatticePoint &b, const LatticePoint &c) {
        return find_small_triangle({a, b, c}, lattice_normal(a, b, c), 2, codes);
    };
    EXPECT_GT(find({5, 5, 5}, {15 * kVoxel + 9, 6, 7}, {9, 3 * kVoxel + 5, 9}), 0U);
    EXPECT_EQ(find({5, 5, 5}, {16 * kVoxel + 1, 6, 7}, {9, 3 * kVoxel + 5, 9}), 0U) << "17 voxels";
    EXPECT_EQ(find({5, 5, kVoxel}, {3 * kVoxel + 1, 6, kVoxel}, {9, 3 * kVoxel + 5, kVoxel}), 0U) << "on a border";
    EXPECT_EQ(find({5, 5, 5}, {kVoxel + 5, kVoxel + 5, 5}, {3 * kVoxel + 5, 3 * kVoxel + 5, 5}), 0U) << "no area";
}

// The bytes of a file depend on these results, so every SIMD target must give the same bits.
TEST(TriangleVoxels, AllVectorInstructionsFindAndMixTheSame) {
    using Results = std::vector<std::uint64_t>;
    const auto all = [] {
        std::mt19937 random(2);
        Results results;
        SmallTriangleCodes codes;
        MixedRows rows;
        for (int round = 0; round < 500; ++round) {
            const int size = round % 10 == 9 ? 3000 : 2 + round % 10; // the largest size exceeds exact arithmetic
            std::uniform_int_distribution<int> place(1, size << kLatticeBits);
            std::array<LatticePoint, 3> corners;
            for (LatticePoint &corner : corners)
                corner = {place(random), place(random), place(random) / 3 + 1};
            if (round % 6 == 0)
                corners[2] = corners[0] + (corners[1] - corners[0]) / 2;
            results.push_back(
                find_small_triangle(corners, lattice_normal(corners[0], corners[1], corners[2]), 2, codes));
            results.insert(results.end(), codes.begin(), codes.begin() + static_cast<std::ptrdiff_t>(results.back()));
            TriangleMix triangle;
            triangle.set_corners({in_voxels(corners[0]), in_voxels(corners[1]), in_voxels(corners[2])});
            triangle.has_colour = true;
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t corner = 0; corner < 3; ++corner) {
                    triangle.normals[k][corner] = static_cast<double>(random() % 65535) - 32767;
                    triangle.colours[k][corner] = static_cast<double>(random() % 65536);
                }
            constexpr std::size_t kFirst = 3, kEnd = 60;
            for (std::size_t row = kFirst; row < kEnd; ++row)
                rows.places[row] = static_cast<PlaceInBlock>(random() & 0x1F1F1F);
            triangle.mix({0.5, 0.5, 0.5}, kFirst, kEnd, rows);
            rows.normals.round(kEnd);
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t row = kFirst; row < kEnd; ++row) {
                    results.push_back(std::bit_cast<std::uint64_t>(rows.weights[k][row]));
                    results.push_back(static_cast<std::uint64_t>(rows.normals.rounded[k][row]));
                    results.push_back(static_cast<std::uint64_t>(rows.colours[k][row]));
                }
        }
        return results;
    };
    const Results expected = all();
    for_every_target([&](const char *target) { EXPECT_EQ(all() == expected, true) << target; });
}

// MortonAxis increments Morton codes instead of encoding each.
TEST(TriangleVoxels, StepsOfACodeFollowOneAxis) {
    for (int axis = 0; axis < 3; ++axis) {
        MortonAxis code(axis, 0);
        for (std::uint32_t voxel = 0; voxel < 70000; ++voxel, code.step()) {
            const std::uint32_t x = axis == 0 ? voxel : 0, y = axis == 1 ? voxel : 0, z = axis == 2 ? voxel : 0;
            ASSERT_EQ(code.code(), morton_encode(x, y, z));
        }
    }
}

// The area of a sliver does not predict how many voxels it passes through.
TEST(Samples, TheLimitOfMemoryHoldsForSliversAsWell) {
    constexpr int kDepth = 14, kSlivers = 2000;
    constexpr std::uint64_t kMaxHits = std::uint64_t{1} << 20;
    Surface surface;
    for (std::uint32_t i = 0; i < kSlivers; ++i) {
        const double height = static_cast<double>(i) / kSlivers;
        surface.positions.insert(surface.positions.end(), {{0, height, 0}, {1, height, 1}, {1, height, 1 + 1e-9}});
        surface.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    const VertexNormals normals{.normals = std::vector<ShortNormal>(surface.positions.size())};
    const Grid grid = centred_grid(bounds_of(surface), kDepth);
    const Bytes radii;
    const SurfaceSampler sampler(surface, {}, normals, radii, {}, grid, 2);
    HitStore hits(kDepth, 2, kMaxHits);
    const Status sampled = sample_points(sampler, hits, hits.all_buckets());
    ASSERT_FALSE(sampled.ok());
    EXPECT_EQ(sampled.error().code, ErrorCode::memory);
    constexpr std::uint64_t kMaxOfOne = std::uint64_t{4} << kDepth; // maximum number of hits of a sliver
    EXPECT_LT(hits.size(), kMaxHits + 2 * kMaxOfOne);
}

// Set after some computing by this process, and so while the test computes, whatever else the machine does.
std::atomic<bool> has_computed = false;

TEST(Voxelize, IsCancelledBetweenItsBuckets) {
    constexpr int kDepth = 9;
    Surface surface;
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> place(0, 1);
    for (int i = 0; i < 1'000'000; ++i)
        surface.positions.emplace_back(place(random), place(random), place(random));
    const VertexNormals normals{.normals = std::vector<ShortNormal>(surface.positions.size())};
    const Grid grid = centred_grid(bounds_of(surface), kDepth);
    const Bytes radii;
    const SurfaceSampler sampler(surface, {}, normals, radii, {}, grid, 1);
    HitStore hits(kDepth, 1, surface.positions.size());
    ASSERT_TRUE(sample_points(sampler, hits, hits.all_buckets()));
    std::signal(SIGVTALRM, [](int) { has_computed = true; });
    const itimerval once{.it_interval = {}, .it_value = {.tv_sec = 0, .tv_usec = 1000}};
    ASSERT_EQ(::setitimer(ITIMER_VIRTUAL, &once, nullptr), 0);
    const CancellationScope scope(&has_computed);
    EXPECT_THROW(voxelize(sampler, hits, hits.all_buckets(), {}, {}, false, 1), Cancelled);
    EXPECT_GT(hits.size(), 0U) << "all buckets were taken before";
    std::signal(SIGVTALRM, SIG_DFL);
}

// Consecutive hits are packed as runs: within a block, across blocks and buckets, and longer than a chunk.
TEST(HitStore, GivesBackWhatEachWriterFoundInItsOrder) {
    std::mt19937_64 random(1);
    for (const int depth : {2, 6, 10, 12, kMaxDepth}) {
        HitStore store(depth, 2, ~std::uint64_t{0});
        std::vector<std::vector<Hit>> expected(2 * store.bucket_count());
        std::uint64_t count = 0;
        const MortonCode last = (MortonCode{1} << 3 * depth) - 1;
        for (std::uint32_t source = 0; source < 300; ++source) {
            const MortonCode first = random() & last, step = MortonCode{1} << random() % 20;
            std::vector<MortonCode> codes(source % 50 == 0 ? 20000 : 1 + random() % 30);
            for (std::size_t i = 0; i < codes.size(); ++i)
                codes[i] = (first + i * step) & last;
            const std::uint32_t named = source % 7 == 0 ? static_cast<std::uint32_t>(kMaxSources - 1 - source) : source;
            const auto writer = static_cast<int>(random() % 2);
            for (const MortonCode code : codes)
                expected[2 * (code >> store.local_bits()) + static_cast<std::size_t>(writer)].push_back(
                    (code & ((MortonCode{1} << store.local_bits()) - 1)) << kSourceBits | named);
            count += codes.size();
            if (source % 2 == 0)
                store.add(writer, codes, named);
            else
                for (const MortonCode code : codes)
                    store.add(writer, code, named);
        }
        EXPECT_EQ(store.size(), count);
        for (std::size_t bucket = 0; bucket < store.bucket_count(); ++bucket) {
            std::vector<Hit> taken{7}, wanted{7};
            for (std::size_t writer = 0; writer < 2; ++writer)
                wanted.insert(wanted.end(), expected[2 * bucket + writer].begin(), expected[2 * bucket + writer].end());
            store.take(bucket, taken);
            ASSERT_EQ(taken, wanted) << "depth " << depth << ", bucket " << bucket;
        }
        EXPECT_EQ(store.size(), 0U);
    }
}

TEST(RadixSort, SortsByTheBitsItWasGivenAndKeepsTheOrderOfEqualOnes) {
    std::mt19937_64 random(1);
    for (const std::size_t count : {0U, 1U, 300U, 20000U, 5000000U}) { // the last one in parts
        std::vector<std::uint64_t> words(count), spare;
        for (std::uint64_t &word : words)
            word = random();
        std::vector<std::uint64_t> expected = words;
        const auto key = [](std::uint64_t word) { return word >> 7 & 0xFFFF; };
        std::stable_sort(expected.begin(), expected.end(), [&](auto a, auto b) { return key(a) < key(b); });
        radix_sort(words, spare, 7, 16);
        EXPECT_EQ(words, expected);
    }
}

TEST(SplatRadius, DenseSamplesCoverTheirVoxel) {
    for (int depth = 5; depth <= kMaxDepth; ++depth) {
        const double voxels = radius_fraction(dense_radius(depth)) * static_cast<double>(1 << depth);
        EXPECT_GT(voxels, 0.87);
        EXPECT_LT(voxels, 0.9);
    }
    EXPECT_EQ(dense_radius(2), kMaxFinestRadius);
}

TEST(SplatRadius, ClassesRoundUpAndStayBelowTheLimit) {
    const std::uint8_t dense = dense_radius(9);
    const RadiusClasses classes = radius_classes(9);
    EXPECT_EQ(classes[0], dense);
    EXPECT_EQ(classes[dense], dense);
    EXPECT_EQ(classes[dense + 1], dense + 4);
    EXPECT_EQ(classes[dense + 4], dense + 4);
    EXPECT_EQ(classes[dense + 25], dense + 25);
    EXPECT_EQ(classes[255], kMaxFinestRadius);
    for (std::size_t index = 0; index < kMaxFinestRadius; ++index) {
        EXPECT_GE(classes[index], index);
        EXPECT_EQ(classes[classes[index]], classes[index]) << "what is a class already stays";
    }
}

// BVG.md 5.8.4 predicts the largest radius that a node covers: a larger radius must give the node another one.
TEST(SplatRadius, ANodeForetellsTheLargestClassBelowIt) {
    for (const int depth : {5, 9, 12, 16})
        for (const std::uint8_t radius : radius_classes(depth)) {
            if (radius == dense_radius(depth) || radius == kMaxFinestRadius)
                continue;
            const auto next = static_cast<std::uint8_t>(radius + 1);
            EXPECT_GT(covering_radius(next, depth - 1), covering_radius(radius, depth - 1));
        }
}

TEST(SplatRadius, GivenRadiiAreUsed) {
    Grid grid;
    grid.depth = 8;
    grid.voxel_size = 0.5; // the cube has edge 128
    Surface surface;
    surface.positions.resize(3);
    surface.radii = {0.01F, 2.0F, 100.0F};
    const Bytes points = given_radii(surface, grid);
    EXPECT_EQ(points[0], dense_radius(8));
    EXPECT_GE(radius_fraction(points[1]) * 128, 2.0);
    EXPECT_LE(radius_fraction(points[1]) * 128, 2.0 * 1.26);
    EXPECT_EQ(points[2], kMaxFinestRadius);
    surface.positions[0] = {0.25, 0.25, 0.25}; // of a model: the middle of a voxel
    EXPECT_EQ(given_radii(surface, grid)[0], radius_index(0.01 / 128));
    surface.triangles = {{0, 1, 2}};
    EXPECT_EQ(given_radii(surface, grid)[0], dense_radius(8));
    EXPECT_LE(radius_fraction(given_radii(surface, grid)[2]) * 128, 1.0 * 1.26) << "two voxels and the step to a class";
}

TEST(TangentCell, ASquareGridLeavesASquare) {
    TangentCell cell(4);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            if (x != 0 || y != 0)
                cell.cut({x, y});
    EXPECT_FALSE(cell.reach().open);
    EXPECT_NEAR(cell.reach().closed, std::sqrt(0.5), 1e-12);
}

TEST(TangentCell, WithoutNeighboursOnOneSideItIsOpen) {
    TangentCell cell(4);
    EXPECT_TRUE(cell.reach().open);
    EXPECT_EQ(cell.reach().closed, 0);
    for (const glm::dvec2 other : {glm::dvec2(0, 1), glm::dvec2(0, -1), glm::dvec2(1, 0)})
        cell.cut(other);
    EXPECT_TRUE(cell.reach().open);
    EXPECT_NEAR(cell.reach().closed, std::sqrt(0.5), 1e-12);
}

TEST(SplatRadius, PointsCoverTheirCell) {
    constexpr int kDepth = 8;
    Voxels voxels; // a grid of points: 3 voxels apart in x, 2 in y
    for (std::uint32_t y = 0; y < 60; ++y)
        for (std::uint32_t x = 0; x < 40; ++x)
            voxels.codes.push_back(morton_encode(3 * x, 2 * y, 100));
    voxels.codes.push_back(morton_encode(250, 250, 250)); // a stray point
    std::sort(voxels.codes.begin(), voxels.codes.end());
    voxels.points.resize(voxels.codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    radii_from_neighbours(voxels, {}, kDepth, 2);
    const double cell = std::hypot(1.5, 1);
    for (std::size_t i = 0; i < voxels.codes.size(); ++i) {
        const auto v = morton_decode(voxels.codes[i]);
        const double radius = radius_fraction(voxels.points.radii[i]) * (1 << kDepth);
        const bool inside = v[0] > 0 && v[1] > 0 && v[0] < 117 && v[1] < 118;
        EXPECT_GE(radius, cell * 1.099);
        EXPECT_LE(radius, (inside ? cell * 1.1 * 1.5 : std::hypot(3, 4)) * 1.26);
    }
}

// From three voxels on each index is a class: rounding up to a class hides a smaller overlap no longer.
TEST(SplatRadius, SplatsReachATenthFartherThanTheirCell) {
    constexpr int kDepth = 8, kApart = 8;
    Voxels voxels;
    for (std::uint32_t y = 0; y < 15; ++y)
        for (std::uint32_t x = 0; x < 15; ++x)
            voxels.codes.push_back(morton_encode(kApart * x, kApart * y, 100));
    std::sort(voxels.codes.begin(), voxels.codes.end());
    voxels.points.resize(voxels.codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    radii_from_neighbours(voxels, {}, kDepth, 2);
    const std::uint8_t expected = radius_index(1.1 * kApart * std::sqrt(0.5) / (1 << kDepth));
    ASSERT_GT(expected, radius_index(kApart * std::sqrt(0.5) / (1 << kDepth)));
    for (std::size_t i = 0; i < voxels.codes.size(); ++i)
        if (const auto v = morton_decode(voxels.codes[i]);
            std::min(v[0], v[1]) > kApart && std::max(v[0], v[1]) < 13 * kApart) {
            EXPECT_EQ(voxels.points.radii[i], expected);
        }
}

// The same for every compiler and machine. The scan has what the constants of the radii are for: sparse and dense
// parts, a fold, a hole, a thin wall, borders and stray points.
TEST(SplatRadius, HasItsGoldenBytes) {
    constexpr int kDepth = 8;
    std::mt19937 random(5);
    std::map<MortonCode, std::uint16_t> points;
    const auto add = [&](std::uint32_t x, std::uint32_t y, double z, double nx, double nz) {
        points[morton_encode(x, y, static_cast<std::uint32_t>(z))] = quantise_normal(nx, 0, nz);
    };
    for (std::uint32_t y = 0; y < 200; ++y)
        for (std::uint32_t x = 0; x < 200; ++x) {
            const double away = std::hypot(x - 60.0, y - 140.0);
            if (random() % (1 + y / 12) != 0 || away < 14 || (away < 30 && x % 5 != 0))
                continue;
            const double slope = x < 100 ? 0.5 : -0.8;
            add(x, y, 90 + slope * (x - 100.0), -slope, 1);
            if (x > 150 && y < 60)
                add(x, y, 88 + slope * (x - 100.0), slope, -1);
        }
    for (int i = 0; i < 20; ++i) {
        const auto x = static_cast<std::uint32_t>(random() % 256), y = static_cast<std::uint32_t>(random() % 256);
        add(x, y, 200 + static_cast<double>(random() % 50), 1, 1);
    }
    Voxels voxels;
    voxels.points.resize(points.size(), {});
    for (std::size_t i = 0; const auto &[code, normal] : points) {
        voxels.codes.push_back(code);
        voxels.points.normals[i++] = normal;
    }
    radii_from_neighbours(voxels, {}, kDepth, 2);
    EXPECT_EQ(hash64(voxels.points.radii), 1237438278494964073U);
}

// Points of the plane z = 100, three voxels apart, without those in a hole; `made`: with a made point in each voxel
// between them, but in the hole.
Voxels plane_with_a_hole(bool made) {
    Voxels voxels;
    for (std::uint32_t y = 0; y < 61; ++y)
        for (std::uint32_t x = 0; x < 61; ++x) {
            const bool given = x % 3 == 0 && y % 3 == 0;
            if ((x > 24 && x < 33 && y > 24 && y < 33) || (!given && !made))
                continue;
            voxels.codes.push_back(morton_encode(x, y, 100));
            if (!given)
                voxels.made.push_back(voxels.codes.back());
        }
    std::sort(voxels.codes.begin(), voxels.codes.end());
    std::sort(voxels.made.begin(), voxels.made.end());
    voxels.points.resize(voxels.codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    radii_from_neighbours(voxels, {}, 8, 2);
    return voxels;
}

TEST(SplatRadius, MadePointsOpenNoPlaceThatWasCovered) {
    const Voxels before = plane_with_a_hole(false), after = plane_with_a_hole(true);
    const auto covers = [](const Voxels &voxels, const glm::dvec2 &place) {
        for (std::size_t i = 0; i < voxels.codes.size(); ++i) {
            const auto v = morton_decode(voxels.codes[i]);
            if (glm::length(place - glm::dvec2(v[0], v[1])) <= radius_fraction(voxels.points.radii[i]) * 256)
                return true;
        }
        return false;
    };
    std::size_t covered = 0;
    for (double y = 22; y <= 35; y += 0.25)
        for (double x = 22; x <= 35; x += 0.25)
            if (const glm::dvec2 place(x, y); covers(before, place)) {
                ++covered;
                EXPECT_TRUE(covers(after, place)) << x << " " << y;
            }
    EXPECT_GT(covered, 1500U) << "some of 2809 lie in the hole";
    double largest = 0; // of the splats far from the hole
    for (std::size_t i = 0; i < after.codes.size(); ++i)
        if (const auto v = morton_decode(after.codes[i]); v[0] > 5 && v[0] < 18 && v[1] > 5 && v[1] < 18)
            largest = std::max(largest, radius_fraction(after.points.radii[i]) * 256);
    EXPECT_LT(largest, 1.2) << "voxels: between made points splats are small";
}

// The nearest 12 points of each lie on its own line.
TEST(SplatRadius, GapsBetweenScanLinesClose) {
    constexpr int kDepth = 8, kApart = 7;
    Voxels voxels;
    for (std::uint32_t y = 0; y < 12; ++y)
        for (std::uint32_t x = 0; x < 100; ++x)
            voxels.codes.push_back(morton_encode(x, kApart * y, 100));
    std::sort(voxels.codes.begin(), voxels.codes.end());
    voxels.points.resize(voxels.codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    radii_from_neighbours(voxels, {}, kDepth, 2);
    for (std::size_t i = 0; i < voxels.codes.size(); ++i) {
        const auto v = morton_decode(voxels.codes[i]);
        const bool inside = v[0] > 10 && v[0] < 90 && v[1] > 0 && v[1] < 11 * kApart;
        if (inside) {
            EXPECT_GE(radius_fraction(voxels.points.radii[i]) * (1 << kDepth), std::hypot(0.5, kApart / 2.0));
        }
    }
}

// A dense square with a hole of 20 voxels: its edge is a border, and splats there do not reach into it.
TEST(SplatRadius, SplatsAtALargeHoleAreNoLargerThanThoseAtABorder) {
    constexpr int kDepth = 8;
    Voxels voxels;
    for (std::uint32_t y = 0; y < 60; ++y)
        for (std::uint32_t x = 0; x < 60; ++x)
            if (std::hypot(static_cast<double>(x) - 30, static_cast<double>(y) - 30) > 10)
                voxels.codes.push_back(morton_encode(x, y, 100));
    std::sort(voxels.codes.begin(), voxels.codes.end());
    voxels.points.resize(voxels.codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    radii_from_neighbours(voxels, {}, kDepth, 2);
    for (const std::uint8_t radius : voxels.points.radii)
        EXPECT_LE(radius_fraction(radius) * (1 << kDepth), 2 * 1.26 * 1.1);
}

TEST(SplatRadius, PointsBelowOneNodeShareTheLargestRadiusAmongThem) {
    constexpr int kDepth = 8;
    std::mt19937 random(1);
    std::uniform_int_distribution<std::uint32_t> place(0, 119);
    std::set<MortonCode> codes;
    while (codes.size() < 3000) {
        const std::uint32_t x = place(random), y = place(random);
        codes.insert(morton_encode(x, y, 60));
    }
    Voxels voxels;
    voxels.codes.assign(codes.begin(), codes.end());
    voxels.points.resize(codes.size(), {});
    std::fill(voxels.points.normals.begin(), voxels.points.normals.end(), quantise_normal(0, 0, 1));
    voxels.points.radii[0] = dense_radius(kDepth); // a given radius is kept
    radii_from_neighbours(voxels, {}, kDepth, 2);
    const Bytes &radii = voxels.points.radii;
    EXPECT_EQ(radii[0], dense_radius(kDepth));
    std::size_t points = 0, shared = 0;
    for (std::size_t i = 1, end = 1; i < radii.size(); i = end) {
        std::uint8_t largest = 0;
        for (; end < radii.size() && voxels.codes[end] >> 3 == voxels.codes[i] >> 3; ++end)
            largest = std::max(largest, radii[end]);
        for (; i < end; ++i, ++points) {
            shared += radii[i] == largest ? 1 : 0;
            EXPECT_TRUE(radii[i] == largest || largest - radii[i] > 7);
        }
    }
    EXPECT_GT(shared, points * 3 / 4);
    EXPECT_LT(shared, points) << "nodes whose points are very unlike are there as well";
}

} // namespace
