// Bricks that are left out: no point of them may be seen, and they are many.
#include "pbm_render/bricks/brick_culling.h"

#include "pbm_format/chunks/normal_cone.h"
#include "unit/support/test_models.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pbm {
namespace {

constexpr int kBrickLevel = 8, kPictureEdge = 400;
constexpr double kVoxelEdge = 1.0 / (1 << kBrickLevel);

glm::dvec3 random_direction(test::Random &random) {
    return glm::normalize(glm::dvec3(random.unit(), random.unit(), random.unit()) - 0.5);
}

std::uint16_t index_of(const glm::dvec3 &normal) { return quantise_normal(normal.x, normal.y, normal.z); }

glm::dvec3 normal_of(std::uint16_t index) {
    const UnitVector &n = normal_table()[index];
    return {n[0], n[1], n[2]};
}

// Bricks at random places of a level. Each has two points, and a cone that holds the normals of both; these are at most
// `spread` apart in each coordinate.
struct Bricks {
    Bricks(std::size_t count, double spread, test::Random &random) {
        for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec3 n = random_direction(random);
            const std::uint16_t a = index_of(n), b = index_of(n + spread * random_direction(random));
            normals.insert(normals.end(), {a, b});
            const NormalCone cone = bound_normals(std::span(normals).last(2));
            const auto place = [&random] { return static_cast<std::uint16_t>(random.below(1 << (kBrickLevel - 3))); };
            records.push_back({.x = place(),
                               .y = place(),
                               .z = place(),
                               .first_point = static_cast<std::uint16_t>(2 * i),
                               .cone_axis = cone.axis,
                               .cone_cosine = cone.cosine,
                               .largest_radius = radius_index(0.89 * kVoxelEdge)});
        }
        view.bricks = records;
        view.normals = normals;
    }
    Bricks(const Bricks &) = delete;
    Bricks &operator=(const Bricks &) = delete;

    // From now on nothing is known of the normals.
    void forget_cones() {
        for (BrickRecord &record : records) {
            record.cone_axis = 0;
            record.cone_cosine = kNoCone;
        }
    }
    PointRun run(std::size_t first_brick, std::size_t end_brick) const {
        return {.chunk = &view,
                .level = kBrickLevel,
                .first = static_cast<std::uint32_t>(2 * first_brick),
                .last = static_cast<std::uint32_t>(2 * end_brick)};
    }
    PointRun run() const { return run(0, records.size()); }

    std::vector<std::uint16_t> normals;
    std::vector<BrickRecord> records;
    ChunkView view;
};

FrameGeometry frame_from(const glm::dvec3 &eye, const glm::dvec3 &target, double view_angle,
                         Backs backs = Backs::hide) {
    Camera camera;
    camera.position = eye;
    camera.focal_point = target;
    camera.view_angle = view_angle;
    camera.backs = backs;
    return {Projection(camera, kPictureEdge, kPictureEdge), kPictureEdge, kPictureEdge};
}

std::vector<VisibleBrick> visible(const PointRun &run, const FrameGeometry &frame) {
    std::vector<VisibleBrick> seen(run.chunk->bricks.size());
    seen.resize(find_visible_bricks(RunGeometry(run, frame), frame, seen));
    return seen;
}

// Whether the picture holds this point: a splat without extent.
bool is_in_picture(const glm::dvec3 &point, const FrameGeometry &frame) {
    const Projection &p = frame.projection;
    const glm::dvec3 sight = point - p.eye;
    const double depth = glm::dot(sight, p.axes.forward), limit = depth * kPictureEdge / 2;
    return depth > 0 && std::abs(glm::dot(sight, p.axes.right) * p.focal) < limit &&
           std::abs(glm::dot(sight, p.axes.up) * p.focal) < limit;
}

// What the corners of a brick, centres of voxels, say of all its points. `cosine`: of the normal and the ray from the
// eye, the smallest and the largest.
struct Corners {
    bool in_picture = false;
    double least_cosine = 1, most_cosine = -1;
};

Corners corners_of(const Bricks &bricks, std::size_t brick, const FrameGeometry &frame) {
    const BrickRecord &record = bricks.records[brick];
    Corners corners;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 voxel(8 * record.x + 7 * (corner & 1), 8 * record.y + 7 * (corner >> 1 & 1),
                               8 * record.z + 7 * (corner >> 2));
        const glm::dvec3 point = (voxel + 0.5) * kVoxelEdge;
        corners.in_picture = corners.in_picture || is_in_picture(point, frame);
        for (const std::size_t i : {2 * brick, 2 * brick + 1}) {
            const double cosine = glm::dot(normal_of(bricks.normals[i]), glm::normalize(point - frame.projection.eye));
            corners.least_cosine = std::min(corners.least_cosine, cosine);
            corners.most_cosine = std::max(corners.most_cosine, cosine);
        }
    }
    return corners;
}

// The renderers draw a point whose cosine is at most kFacingSlack (facing_points.h).
TEST(BrickCulling, NoBrickIsLeftOutThatHasAPointInThePictureThatFacesTheEye) {
    test::Random random(11);
    std::size_t left_out = 0, at_the_border = 0;
    for (int view = 0; view < 60; ++view) {
        const Bricks bricks(1003, view % 3 * 0.2, random); // no whole number of SIMD vectors
        const double distance = view % 2 == 0 ? 0.1 + 0.5 * random.unit() : 1.5 + random.unit();
        const FrameGeometry frame =
            frame_from(glm::dvec3(0.5) + distance * random_direction(random), glm::dvec3(0.5), 1.2);
        std::vector<bool> is_seen(bricks.records.size());
        for (const VisibleBrick &brick : visible(bricks.run(), frame))
            is_seen[brick.brick] = true;
        for (std::size_t i = 0; i < is_seen.size(); ++i) {
            const Corners corners = corners_of(bricks, i, frame);
            if (is_seen[i] || !corners.in_picture)
                continue;
            ++left_out;
            at_the_border += corners.least_cosine < static_cast<double>(kFacingSlack) + 0.03 ? 1 : 0;
            EXPECT_GT(corners.least_cosine, static_cast<double>(kFacingSlack)) << view << " " << i;
        }
    }
    EXPECT_GT(left_out, 10000U);
    EXPECT_GT(at_the_border, 100U) << "bricks that a smaller bound would leave out wrongly are among them";
}

// The bound of a brick's extent costs a little: at this distance reach / distance is at most 0.03 / 3.
TEST(BrickCulling, BricksThatFaceAwayWithAMarginAreLeftOut) {
    test::Random random(12);
    const Bricks bricks(2000, 0, random);
    const glm::dvec3 eye = glm::dvec3(0.5) + 4.0 * glm::normalize(glm::dvec3(0.3, 0.5, 0.8));
    const FrameGeometry frame = frame_from(eye, glm::dvec3(0.5), 1.2);
    const std::vector<VisibleBrick> seen = visible(bricks.run(), frame);
    EXPECT_LT(seen.size(), 1200U);
    for (const VisibleBrick &brick : seen)
        EXPECT_LT(corners_of(bricks, brick.brick, frame).least_cosine, static_cast<double>(kFacingSlack) + 0.03);
}

TEST(BrickCulling, BricksOutsideOfThePictureAreLeftOut) {
    test::Random random(13);
    Bricks bricks(2000, 0, random);
    bricks.forget_cones();
    const FrameGeometry frame = frame_from({0.5, 0.5, 4}, glm::dvec3(0.5), 0.1);
    for (const VisibleBrick &brick : visible(bricks.run(), frame)) {
        const BrickRecord &record = bricks.records[brick.brick];
        const glm::dvec3 sight = (glm::dvec3(record.x, record.y, record.z) * 8.0 + 4.0) * kVoxelEdge - glm::dvec3(0.5);
        const double depth = 3.5 - sight.z, half = depth * std::tan(0.05);
        EXPECT_LT(std::max(std::abs(sight.x), std::abs(sight.y)), half + 0.04) << "the brick's reach, and two pixels";
    }
}

TEST(BrickCulling, ARunShowsTheBricksOfItsPointsOnly) {
    test::Random random(14);
    Bricks bricks(100, 0, random);
    bricks.forget_cones();
    const FrameGeometry frame = frame_from({0.5, 0.5, 4}, glm::dvec3(0.5), 1.2);
    for (const auto &[first, end] : {std::pair(0, 100), {0, 1}, {7, 8}, {3, 40}, {99, 100}}) {
        std::vector<int> seen, expected;
        for (const VisibleBrick &brick :
             visible(bricks.run(static_cast<std::size_t>(first), static_cast<std::size_t>(end)), frame))
            seen.push_back(static_cast<int>(brick.brick));
        for (int i = first; i < end; ++i)
            expected.push_back(i);
        EXPECT_EQ(seen, expected);
    }
}

// Where backs are shown no brick is left out, and each says on which sides its points are seen.
TEST(BrickCulling, BricksSayWhetherTheyHaveFrontsAndBacks) {
    test::Random random(15);
    const double slack = static_cast<double>(kFacingSlack);
    std::size_t fronts_alone = 0, backs_alone = 0;
    for (int view = 0; view < 20; ++view) {
        const Bricks bricks(500, 0.2, random);
        const FrameGeometry frame =
            frame_from(glm::dvec3(0.5) + 2.0 * random_direction(random), glm::dvec3(0.5), 1.5, Backs::show);
        const std::vector<VisibleBrick> seen = visible(bricks.run(), frame);
        EXPECT_EQ(seen.size(), bricks.records.size());
        for (const VisibleBrick &brick : seen) {
            const Corners corners = corners_of(bricks, brick.brick, frame);
            EXPECT_TRUE(brick.has_fronts || corners.least_cosine > slack);
            EXPECT_TRUE(brick.has_backs || corners.most_cosine < 0);
            EXPECT_TRUE(!brick.faces_away || corners.least_cosine > 0);
            fronts_alone += brick.has_backs ? 0 : 1;
            backs_alone += brick.has_fronts ? 0 : 1;
        }
    }
    EXPECT_GT(fronts_alone, 2000U);
    EXPECT_GT(backs_alone, 2000U);
}

TEST(BrickCulling, RowsHoldThePointsOfABrick) {
    test::Random random(16);
    for (int view = 0; view < 20; ++view) {
        const Bricks bricks(500, 0, random);
        const double distance = view % 2 == 0 ? 0.3 : 2;
        const FrameGeometry frame = frame_from(glm::dvec3(0.5) + distance * random_direction(random),
                                               glm::dvec3(0.5) + 0.2 * random_direction(random), 1.0, Backs::show);
        const Projection &p = frame.projection;
        for (const VisibleBrick &brick : visible(bricks.run(), frame)) {
            const BrickRecord &record = bricks.records[brick.brick];
            const double radius = static_cast<double>(frame.radii[record.largest_radius]);
            for (int corner = 0; corner < 8; ++corner) {
                const glm::dvec3 voxel(8 * record.x + 7 * (corner & 1), 8 * record.y + 7 * (corner >> 1 & 1),
                                       8 * record.z + 7 * (corner >> 2));
                const glm::dvec3 point = (voxel + 0.5) * kVoxelEdge;
                for (const double rim : {-radius, radius}) {
                    const glm::dvec3 sight = point + rim * p.axes.up - p.eye;
                    const double depth = glm::dot(sight, p.axes.forward);
                    const double row = p.middle.y - glm::dot(sight, p.axes.up) * p.focal / depth;
                    if (depth <= radius || row < 0 || row >= kPictureEdge)
                        continue;
                    EXPECT_GE(row, brick.top);
                    EXPECT_LT(row, brick.bottom);
                }
            }
        }
    }
}

} // namespace
} // namespace pbm
