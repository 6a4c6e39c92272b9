// Where surfaces lie in their voxels: against the definition, against a ball, and in the outlines of pictures.
#include "pbm_render/surface_offsets.h"

#include "pbm_render/fine_renderer.h"
#include "render_fast_test_model.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <map>

namespace pbm {
namespace {

using test::smooth_ball;

constexpr int kDepth = 7;

using Voxel = std::array<int, 3>;

// Places of a chunk's points, in their order.
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

UnitVector normal_of(std::uint16_t stored) { return normal_table()[stored & kNormalIndexMask]; }

double dot(const UnitVector &a, const UnitVector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Of the occupied voxels around that are of the same side.
double mean_along(const Voxel &at, const UnitVector &normal, const std::map<Voxel, UnitVector> &normals) {
    double sum = 0, weights = 0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const auto found = normals.find({at[0] + x, at[1] + y, at[2] + z});
                if (found == normals.end() || dot(found->second, normal) < 0.5)
                    continue;
                const UnitVector both{normal[0] + found->second[0], normal[1] + found->second[1],
                                      normal[2] + found->second[2]};
                const double bent = (both[0] * x + both[1] * y + both[2] * z) / (1 + dot(found->second, normal));
                const double along = normal[0] * x + normal[1] * y + normal[2] * z;
                const double weight = 1 - (x * x + y * y + z * z - along * along) / 2.25;
                if (weight <= 0)
                    continue;
                sum += weight * bent;
                weights += weight;
            }
    return sum / weights;
}

TEST(SurfaceOffsets, AreTheMeanOfVoxelsOfTheSameSideAlongTheNormal) {
    const test::DrawnModel model(smooth_ball(kDepth, {}, 50));
    SurfaceOffsets estimate;
    std::vector<std::int8_t> offsets;
    for (int level = 1; level <= kDepth; ++level) {
        const test::WholeLevel whole(model.file, level);
        for (const PointRun &run : whole.runs) {
            offsets.resize(run.chunk->normals.size());
            estimate.estimate(*run.chunk, offsets);
            const std::vector<Voxel> voxels = voxels_of(*run.chunk);
            ASSERT_EQ(offsets.size(), voxels.size());
            std::map<Voxel, UnitVector> normals;
            for (std::size_t i = 0; i < voxels.size(); ++i)
                normals[voxels[i]] = normal_of(run.chunk->normals[i]);
            for (std::size_t i = 0; i < voxels.size(); ++i) {
                const std::uint16_t stored = run.chunk->normals[i];
                if ((stored & kTwoSidedBit) != 0) {
                    EXPECT_EQ(offsets[i], 0);
                    continue;
                }
                const double mean = mean_along(voxels[i], normal_of(stored), normals);
                const double expected = std::clamp(mean, -0.875, 0.875) * 127 / 0.875;
                EXPECT_NEAR(offsets[i], expected, 1.01) << "level " << level << ", point " << i;
            }
        }
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
        offsets.resize(run.chunk->normals.size());
        estimate.estimate(*run.chunk, offsets);
        const std::vector<Voxel> voxels = voxels_of(*run.chunk);
        for (std::size_t i = 0; i < voxels.size(); ++i, ++points) {
            UnitVector from_middle{};
            for (std::size_t axis = 0; axis < 3; ++axis)
                from_middle[axis] = voxels[i][axis] + 0.5 - 0.5 * (1 << kDepth);
            const double out = 0.45 * (1 << kDepth) - std::sqrt(dot(from_middle, from_middle));
            before += out * out;
            const double error = out - static_cast<double>(offsets[i]) / static_cast<double>(kOffsetSteps);
            after += error * error;
        }
    }
    EXPECT_GT(std::sqrt(before / static_cast<double>(points)), 0.4);
    EXPECT_LT(std::sqrt(after / static_cast<double>(points)), 0.13);
}

// Pixels by how far the ray passes outside of the ball.
TEST(SurfaceOffsets, FinePicturesHaveSmoothOutlines) {
    const test::DrawnModel model(smooth_ball(kDepth, {}), kDefaultChunkPoints);
    const test::WholeLevel whole(model.file, kDepth);
    for (const double pixels : {1.0, 3.0, 6.0}) {
        constexpr int kWidth = 820, kHeight = 800;
        const Camera camera = test::camera_at_ball(kDepth, pixels, kHeight);
        Framebuffer picture(kWidth, kHeight);
        FineRenderer(model.model.parameters, kDefaultChunkPoints, 2)
            .render(whole.runs, camera, {.samples = 1}, picture);
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
