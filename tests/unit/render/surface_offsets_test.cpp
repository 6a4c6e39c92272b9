// Surface offsets: against their definition, on a ball, and in the outlines of pictures.
#include "pbm_surface/surface_offsets.h"

#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fine/fine_renderer.h"
#include "unit/render/fast_test_model.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <thread>

namespace pbm {
namespace {

using test::smooth_ball;

constexpr int kDepth = 7;

using Voxel = std::array<int, 3>;

// Voxel coordinates of a chunk's points, in order.
std::vector<Voxel> voxels_of(const ChunkView &chunk) {
    std::vector<Voxel> voxels;
    for (const BrickRecord &brick : chunk.bricks) {
        std::size_t node = brick.first_node;
        for (std::uint64_t map = brick.node_map; map != 0; map &= map - 1, ++node)
            for (unsigned mask = chunk.masks[node]; mask != 0; mask &= mask - 1) {
                const auto place = morton_decode(8 * static_cast<MortonCode>(std::countr_zero(map)) +
                                                 static_cast<MortonCode>(std::countr_zero(mask)));
                voxels.push_back({8 * brick.x + static_cast<int>(place[0]), 8 * brick.y + static_cast<int>(place[1]),
                                  8 * brick.z + static_cast<int>(place[2])});
            }
    }
    return voxels;
}

double dot(const UnitVector &a, const UnitVector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The middle normal of those whose index shares all digits but the last two.
UnitVector middle_normal(std::uint16_t stored) { return normal_table()[stored & kNormalIndexMask & ~15U]; }

bool is_of_same_side(const UnitVector &normal, const UnitVector &other) {
    bool same = false, opposite = false;
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (std::abs(normal[axis]) > 0.38 && std::abs(other[axis]) > 0.5)
            ((normal[axis] > 0) == (other[axis] > 0) ? same : opposite) = true;
    return same && !opposite;
}

// Weighted mean along the normal, over the 3 x 3 x 3 neighbours of the same side, and what lifts it to the outermost of
// several layers.
double surface_along(const Voxel &at, const UnitVector &normal, const std::map<Voxel, UnitVector> &normals,
                     double lift = kLayerLift) {
    double sum = 0, weights = 0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const auto found = normals.find({at[0] + x, at[1] + y, at[2] + z});
                const double along = normal[0] * x + normal[1] * y + normal[2] * z;
                const double weight = 3 - (x * x + y * y + z * z - along * along);
                if (found == normals.end() || !is_of_same_side(normal, found->second))
                    continue;
                sum += weight * along;
                weights += weight;
            }
    return sum / weights + lift * std::max(weights - kOneSurfaceWeight, 0.0);
}

TEST(SurfaceOffsets, AreTheMeanOfVoxelsOfTheSameSideAlongTheNormal) {
    const test::DrawnModel model(smooth_ball(kDepth, {}, 50));
    SurfaceOffsets estimate;
    std::vector<std::int8_t> offsets;
    for (int level = 1; level <= kDepth; ++level) {
        const test::WholeLevel whole(model.file, level);
        for (const PointRun &run : whole.runs) {
            offsets.assign(run.chunk->normals.size(), 0);
            estimate.estimate(*run.chunk, offsets);
            const std::vector<Voxel> voxels = voxels_of(*run.chunk);
            ASSERT_EQ(offsets.size(), voxels.size());
            std::map<Voxel, UnitVector> normals;
            for (std::size_t i = 0; i < voxels.size(); ++i)
                normals[voxels[i]] = middle_normal(run.chunk->normals[i]);
            for (std::size_t i = 0; i < voxels.size(); ++i) {
                const std::uint16_t stored = run.chunk->normals[i];
                if ((stored & kTwoSidedBit) != 0) {
                    EXPECT_EQ(offsets[i], 0);
                    continue;
                }
                const double expected =
                    std::clamp(surface_along(voxels[i], middle_normal(stored), normals), -0.875, 0.875);
                EXPECT_NEAR(offset_of(offsets[i]), expected, 0.017) << "level " << level << ", point " << i;
            }
        }
    }
}

// The next voxel behind one, along the longest axis of its normal.
Voxel voxel_behind(Voxel at, const UnitVector &normal) {
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
        if (std::abs(normal[axis]) > std::abs(normal[longest]))
            longest = axis;
    at[longest] += normal[longest] > 0 ? -1 : 1;
    return at;
}

TEST(SurfaceOffsets, MarkPointsInFrontOfOthersAsRedundant) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    const std::vector<std::int8_t> offsets = whole.offsets();
    const ChunkView &chunk = *whole.runs.front().chunk;
    ASSERT_EQ(offsets.size(), chunk.normals.size());
    const std::vector<Voxel> voxels = voxels_of(chunk);
    std::map<Voxel, std::size_t> points;
    for (std::size_t i = 0; i < voxels.size(); ++i)
        points[voxels[i]] = i;
    std::size_t redundant = 0;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        if ((offsets[i] & kRedundantBit) == 0)
            continue;
        ++redundant;
        EXPECT_LE(offset_of(offsets[i]), -kRedundantDepth + 0.01F);
        // Behind it, at most two voxels further, is one that is not.
        std::size_t last = i;
        for (int step = 0; step < 3 && (offsets[last] & kRedundantBit) != 0; ++step) {
            const auto behind = points.find(voxel_behind(voxels[last], middle_normal(chunk.normals[last])));
            ASSERT_NE(behind, points.end()) << i;
            last = behind->second;
        }
        EXPECT_EQ(offsets[last] & kRedundantBit, 0) << i;
    }
    EXPECT_GT(redundant, voxels.size() / 4);
    EXPECT_LT(redundant, voxels.size() / 2);
}

TEST(SurfaceOffsets, AreTheSameForAnySimdTarget) {
    const test::DrawnModel model(smooth_ball(kDepth, {}, 50));
    for (const int level : {2, 5, kDepth}) {
        const test::WholeLevel whole(model.file, level);
        const std::vector<std::int8_t> expected = whole.offsets();
        EXPECT_NE(std::ranges::count(expected, 0), std::ssize(expected));
        int tried = 0;
        for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1, ++tried) {
            hwy::SetSupportedTargetsForTest(targets & -targets);
            EXPECT_EQ(whole.offsets(), expected) << hwy::TargetName(targets & -targets);
        }
        hwy::SetSupportedTargetsForTest(0);
        EXPECT_GE(tried, HWY_ARCH_X86 ? 2 : 1);
    }
}

// Bytes of a mapped file may change: sanitizers see accesses out of bounds.
TEST(SurfaceOffsets, OfBytesThatChangedAreOffsetsAsWell) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    const ChunkView &chunk = *whole.runs.front().chunk;
    std::mt19937 random(1);
    SurfaceOffsets estimate;
    std::vector<std::int8_t> offsets;
    for (int round = 0; round < 20; ++round) {
        Bytes masks(chunk.masks.begin(), chunk.masks.end());
        std::vector<std::uint16_t> normals(chunk.normals.begin(), chunk.normals.end());
        std::vector<BrickRecord> bricks(chunk.bricks.begin(), chunk.bricks.end());
        const auto damage = [&](void *bytes, std::size_t size) {
            for (std::size_t i = 0; i < size / 50; ++i)
                static_cast<std::uint8_t *>(bytes)[random() % size] = static_cast<std::uint8_t>(random());
        };
        damage(masks.data(), masks.size());
        damage(normals.data(), 2 * normals.size());
        damage(bricks.data(), sizeof(BrickRecord) * bricks.size());
        normals.resize(normals.size() * static_cast<std::size_t>(round % 2)); // fewer than bricks and masks count
        ChunkView changed;
        changed.masks = masks;
        changed.normals = normals;
        changed.bricks = bricks;
        offsets.assign(changed.normals.size(), 0);
        estimate.estimate(changed, offsets);
        EXPECT_EQ(offsets.size(), normals.size());
    }
}

std::vector<VisibleBrick> seen_bricks(std::uint32_t first, std::uint32_t step, std::size_t end, bool faces_eye) {
    std::vector<VisibleBrick> seen;
    for (std::uint32_t i = first; i < end; i += step)
        seen.push_back({.u = 0,
                        .v = 0,
                        .w = 1,
                        .brick = i,
                        .top = 0,
                        .bottom = 1,
                        .left = 0,
                        .right = 1,
                        .nearest = 0,
                        .faces_eye = faces_eye,
                        .has_fronts = true,
                        .has_backs = false,
                        .faces_away = false,
                        .block = 2,
                        .thin = false,
                        .is_cut = false});
    return seen;
}

// The offsets of all points of a chunk, brick by brick.
std::vector<std::int8_t> read_all(const ChunkOffsets &offsets, const ChunkView &chunk) {
    std::vector<std::int8_t> all(chunk.normals.size());
    for (std::uint32_t brick = 0; brick < chunk.bricks.size(); ++brick) {
        const std::size_t begin = chunk.bricks[brick].first_point;
        const std::size_t end =
            brick + 1 < chunk.bricks.size() ? std::size_t{chunk.bricks[brick + 1].first_point} : all.size();
        BrickOffsets memory;
        std::copy_n(offsets.read(chunk, brick, memory), end - begin, &all[begin]);
    }
    return all;
}

// Whatever was estimated before a brick is read, and whether it is read for the first time.
TEST(ChunkOffsets, AreThoseOfTheWholeChunkWhateverIsAskedFor) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    const ChunkView &chunk = *whole.runs.front().chunk;
    const std::vector<std::int8_t> expected = whole.offsets();
    const std::size_t bricks = chunk.bricks.size();
    ASSERT_GT(bricks, 20U);
    for (const std::uint32_t step : {1U, 3U})
        for (const bool faces_eye : {false, true}) {
            const ChunkOffsets offsets;
            offsets.estimate(chunk, seen_bricks(0, step, bricks, faces_eye));
            for (int time = 0; time < 2; ++time)
                EXPECT_EQ(read_all(offsets, chunk), expected) << step << faces_eye << time;
        }
}

TEST(ChunkOffsets, MayBeAskedForBySeveralThreadsAtOnce) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    const ChunkView &chunk = *whole.runs.front().chunk;
    const ChunkOffsets offsets;
    std::vector<std::vector<std::int8_t>> read(4);
    {
        std::vector<std::jthread> threads;
        for (std::uint32_t i = 0; i < read.size(); ++i)
            threads.emplace_back([&, i] {
                offsets.estimate(chunk, seen_bricks(i, 3, chunk.bricks.size(), true));
                read[i] = read_all(offsets, chunk);
            });
    }
    const std::vector<std::int8_t> expected = whole.offsets();
    for (const std::vector<std::int8_t> &all : read)
        EXPECT_EQ(all, expected);
}

// The offsets of a file take the place of estimates, but not at points that show both sides.
TEST(ChunkOffsets, OfTheFileReplaceEstimates) {
    Model model = smooth_ball(kDepth, {});
    std::vector<std::uint16_t> &normals = model.levels.back().points.normals;
    for (std::size_t i = 0; i < normals.size(); i += 7)
        normals[i] |= kTwoSidedBit;
    const test::DrawnModel drawn(std::move(model), kDefaultChunkPoints);
    const test::WholeLevel whole(drawn.file, kDepth);
    const ChunkView &chunk = *whole.runs.front().chunk;
    const std::vector<std::int8_t> estimated = whole.offsets();
    Offsets stored;
    for (std::uint32_t i = 0; i < chunk.normals.size(); i += 3) {
        stored.points.push_back(i);
        stored.values.push_back(static_cast<std::int8_t>(static_cast<int>(i) % 29 - Offsets::kMost));
    }
    ChunkOffsets offsets;
    offsets.set_stored(stored, chunk);
    offsets.estimate(chunk, seen_bricks(0, 2, chunk.bricks.size(), true));
    const std::vector<std::int8_t> all = read_all(offsets, chunk);
    std::size_t redundant = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (i % 3 != 0 || i % 7 == 0) {
            EXPECT_EQ(all[i], estimated[i]) << i;
            continue;
        }
        const float value = static_cast<float>(stored.values[i / 3]) / Offsets::kSteps;
        EXPECT_NEAR(offset_of(all[i]), value, 0.008) << i;
        const bool is_redundant = (all[i] & kRedundantBit) != 0;
        redundant += is_redundant ? 1 : 0;
        EXPECT_EQ(is_redundant, (estimated[i] & kRedundantBit) != 0 && value <= -kRedundantDepth) << i;
    }
    EXPECT_GT(redundant, 0U);
}

// Offsets that a file has are those of its pictures, in both storage profiles.
TEST(ChunkOffsets, OfTheFileMoveWhatPicturesShow) {
    Model model = smooth_ball(kDepth, {});
    const auto depth_with = [&](int value, Storage storage, auto renderer) {
        Offsets &offsets = model.levels.back().offsets;
        offsets = {};
        for (std::uint32_t i = 0; i < model.point_count() && value != 0; ++i) {
            offsets.points.push_back(i);
            offsets.values.push_back(static_cast<std::int8_t>(value));
        }
        const Bytes file = value_of(encode_model(model, {.storage = storage, .threads = 1}));
        StreamedModel streamed(value_of(Reader::open(file)));
        constexpr int kSize = 128;
        const Camera camera = test::camera_at_ball(kDepth, 2, kSize, {0, 0, 1});
        const Detail detail = value_of(
            streamed.load({.camera = camera, .width = kSize, .height = kSize, .max_error = 0.01, .finest = kDepth}));
        Framebuffer picture(kSize, kSize);
        renderer(detail.runs, camera, picture);
        return static_cast<double>(picture.depth[kSize * kSize / 2 + kSize / 2]) / model.parameters.grid.voxel_size;
    };
    const auto fast = [&](const auto &runs, const Camera &camera, Framebuffer &to) {
        FastRenderer(model.parameters, kDefaultChunkPoints, 1).render(runs, camera, {}, to);
    };
    const auto fine = [&](const auto &runs, const Camera &camera, Framebuffer &to) {
        FineRenderer(model.parameters, kDefaultChunkPoints, 1).render(runs, camera, {}, to);
    };
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        EXPECT_NEAR(depth_with(-12, storage, fast) - depth_with(12, storage, fast), 1.5, 0.2);
        EXPECT_NEAR(depth_with(-12, storage, fine) - depth_with(12, storage, fine), 1.5, 0.2);
    }
}

// Pictures do not depend on which bricks wait: views from the back show first what a view from the front has hidden.
TEST(ChunkOffsets, OfHiddenBricksAreEstimatedWhenTheyAreShown) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    test::WholeLevel turned(model.file, kDepth);
    FastRenderer renderer(model.model.parameters, kDefaultChunkPoints, 2);
    for (const glm::dvec3 direction :
         {glm::dvec3(0.3, 0.5, 0.8), glm::dvec3(-0.8, 0.1, 0.2), glm::dvec3(-0.3, -0.5, -0.8)}) {
        constexpr int kSize = 300;
        const Camera camera = test::camera_at_ball(kDepth, 2, kSize, direction);
        Framebuffer picture(kSize, kSize);
        renderer.render(turned.runs, camera, {}, picture);
        EXPECT_EQ(picture.colour, model.fast(camera, kSize, kSize, {}).colour);
    }
}

TEST(SurfaceOffsets, FindTheSurfaceOfABall) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    SurfaceOffsets estimate;
    std::vector<std::int8_t> offsets;
    double before = 0, after = 0;
    std::size_t points = 0;
    for (const PointRun &run : whole.runs) {
        offsets.assign(run.chunk->normals.size(), 0);
        estimate.estimate(*run.chunk, offsets);
        const std::vector<Voxel> voxels = voxels_of(*run.chunk);
        for (std::size_t i = 0; i < voxels.size(); ++i, ++points) {
            UnitVector from_middle{};
            for (std::size_t axis = 0; axis < 3; ++axis)
                from_middle[axis] = voxels[i][axis] + 0.5 - 0.5 * (1 << kDepth);
            const double out = 0.45 * (1 << kDepth) - std::sqrt(dot(from_middle, from_middle));
            before += out * out;
            const double error = out - static_cast<double>(offset_of(offsets[i]));
            after += error * error;
        }
    }
    EXPECT_GT(std::sqrt(before / static_cast<double>(points)), 0.4);
    EXPECT_LT(std::sqrt(after / static_cast<double>(points)), 0.13);
}

std::vector<MortonCode> finest_codes(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.levels[level].points.size()));
    return codes;
}

// Two balls, one a voxel within the other, as two scans of one surface lie on each other.
TEST(SurfaceOffsets, LieAtTheOutermostOfSeveralLayers) {
    constexpr double kEdge = 1 << kDepth, kRadius = 0.45 * kEdge; // voxels
    Model both = test::sphere_model(kDepth, {});
    std::vector<MortonCode> codes = finest_codes(both);
    const std::vector<MortonCode> within = finest_codes(test::sphere_model(kDepth, {}, (kRadius - 1) / kEdge));
    codes.insert(codes.end(), within.begin(), within.end());
    std::sort(codes.begin(), codes.end());
    codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
    PointAttributes points;
    for (const MortonCode code : codes) {
        const auto [x, y, z] = morton_decode(code);
        points.normals.push_back(quantise_normal(x + 0.5 - kEdge / 2, y + 0.5 - kEdge / 2, z + 0.5 - kEdge / 2));
    }
    points.radii.assign(codes.size(), both.levels.back().points.radii[0]);
    set_levels(both, std::move(codes), std::move(points), 1);

    const test::DrawnModel model(std::move(both), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    const std::vector<std::int8_t> offsets = whole.offsets();
    const std::vector<Voxel> voxels = voxels_of(*whole.runs.front().chunk);
    std::map<Voxel, UnitVector> normals;
    for (std::size_t i = 0; i < voxels.size(); ++i)
        normals[voxels[i]] = middle_normal(whole.runs.front().chunk->normals[i]);
    double squares = 0, squares_of_mean = 0;
    for (const auto &[voxel, normal] : normals) {
        UnitVector from_middle{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            from_middle[axis] = voxel[axis] + 0.5 - kEdge / 2;
        const double out = kRadius - std::sqrt(dot(from_middle, from_middle));
        if (out > 0.3) // another voxel lies in front
            continue;
        const auto at = static_cast<std::size_t>(std::find(voxels.begin(), voxels.end(), voxel) - voxels.begin());
        const double error = out - static_cast<double>(offset_of(offsets[at]));
        const double of_mean = out - surface_along(voxel, normal, normals, 0);
        squares += error * error;
        squares_of_mean += of_mean * of_mean;
    }
    EXPECT_LT(squares, 0.8 * squares_of_mean);
}

// For each pixel: the distance in pixels by which its ray misses the ball.
TEST(SurfaceOffsets, FinePicturesHaveSmoothOutlines) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    for (const double pixels : {1.0, 3.0, 6.0}) {
        constexpr int kWidth = 820, kHeight = 800;
        const Camera camera = test::camera_at_ball(kDepth, pixels, kHeight);
        Framebuffer picture(kWidth, kHeight);
        FineRenderer(model.model.parameters, kDefaultChunkPoints, 2).render(whole.runs, camera, {}, picture, 1);
        const Projection projection(camera, kWidth, kHeight);
        const glm::dvec3 to_middle = glm::dvec3(0, -1, -2) - projection.eye;
        const double limit = std::max(1.25, 0.3 * pixels);
        std::size_t beyond = 0, missing = 0, along = 0;
        for (std::size_t i = 0; i < picture.pixels(); ++i) {
            const glm::dvec3 ray = glm::normalize(projection.ray(glm::dvec2(picture.centre(i))));
            const double outside = (glm::length(glm::cross(ray, to_middle)) - 0.9) * (1 << kDepth) / 2 * pixels;
            const bool drawn = picture.depth[i] != std::numeric_limits<float>::infinity();
            along += std::abs(outside) < 1 ? 1 : 0;
            beyond += drawn && outside > limit ? 1 : 0;
            missing += !drawn && outside < -limit ? 1 : 0;
        }
        ASSERT_GT(along, 700U);
        EXPECT_LE(beyond, pixels > 4 ? along / 10 : pixels > 2 ? 3 : 0) << pixels << " pixels per voxel";
        EXPECT_EQ(missing, 0U) << pixels << " pixels per voxel";
    }
}

} // namespace
} // namespace pbm
