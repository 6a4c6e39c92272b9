#include "pbm_render/camera/framing.h"
#include "pbm_render/camera/transform_table.h"
#include "unit/render/test_model.h"
#include "unit/support/value_of.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <numbers>

namespace pbm {
namespace {

constexpr std::array<glm::ivec2, 3> kSizes{{{640, 360}, {360, 640}, {100, 100}}};

// Box around the projection of the voxels' corners: from the picture's middle, in halves of its size.
struct Projected {
    glm::dvec2 low{1e9}, high{-1e9};
    double reach() const { return std::max({-low.x, -low.y, high.x, high.y}); }
};
Projected project(const Camera &camera, const Model &model, glm::ivec2 size) {
    std::vector<MortonCode> codes{0};
    const int depth = model.parameters.grid.depth;
    for (int level = 1; level <= depth; ++level)
        codes = value_of(expand_level(codes, model.levels[static_cast<std::size_t>(level)].masks, 1 << 20));
    const Projection projection(camera, size.x, size.y);
    Projected box;
    for (const MortonCode code : codes)
        for (int corner = 0; corner < 8; ++corner) {
            const auto [x, y, z] = morton_decode(code);
            const glm::dvec3 p =
                projection.point(glm::dvec3(x, y, z) + glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2));
            EXPECT_GT(p.z, 0);
            const glm::dvec2 at = glm::dvec2(p.x / p.z, p.y / p.z) * 2.0 / glm::dvec2(size) - 1.0;
            box.low = glm::min(box.low, at);
            box.high = glm::max(box.high, at);
        }
    return box;
}

// A tall body whose middle lies far from the centre of its smallest sphere, with an arm towards the viewer.
Model lopsided(int depth = 5) {
    std::vector<TestVoxel> voxels;
    for (std::uint32_t y = 0; y < 20; ++y)
        for (std::uint32_t x = 0; x < 6; ++x)
            for (std::uint32_t z = 0; z < 6; ++z)
                voxels.push_back({{x, y, z}});
    for (std::uint32_t z = 6; z < 30; ++z)
        voxels.push_back({{3, 17, z}});
    return make_test_model(depth, voxels);
}

Model with_up(Model model, UpAxis up) {
    model.parameters.grid.up = up;
    return model;
}

TEST(FindExtent, OfOneVoxelReachesTheBorderOfItsDisc) {
    const Extent extent = find_extent(make_test_model(3, {{{5, 2, 7}}}));
    EXPECT_NEAR(glm::length(extent.sphere.centre - glm::dvec3(5.5, 2.5, 7.5)), 0, 1e-9);
    const double reach = 8 * radius_fraction(radius_index(0.87 / 8));
    EXPECT_NEAR(extent.sphere.radius, std::sqrt(3) * reach, 1e-9);
    EXPECT_EQ(extent.corners.size(), 8U);
}

// 27 points with discs of two voxels: at a coarse level, too, the discs are inside.
TEST(FindExtent, HoldsDiscsOfSparsePoints) {
    for (const int depth : {6, 9}) {
        const std::uint32_t step = 1U << (depth - 2);
        std::vector<TestVoxel> voxels;
        for (std::uint32_t i = 0; i < 27; ++i)
            voxels.push_back({{i % 3 * step + step / 2, i / 3 % 3 * step + step / 2, i / 9 * step + step / 2}});
        Model model = make_test_model(depth, voxels);
        for (std::uint8_t &radius : model.levels.back().points.radii)
            radius = radius_index(1.0 / 32);
        average_levels(model, 1);
        const double reach = model.parameters.grid.edge() / 32;
        glm::dvec3 low(1e9), high(-1e9);
        for (const glm::dvec3 &corner : find_extent(model).corners) {
            low = glm::min(low, corner);
            high = glm::max(high, corner);
        }
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LE(low[axis], step / 2.0 + 0.5 - reach) << depth;
            EXPECT_GE(high[axis], 2.5 * step + 0.5 + reach) << depth;
        }
    }
}

TEST(FindExtent, SphereOfAWallIsItsDiagonal) {
    const Sphere sphere = find_extent(make_wall(6, 10)).sphere;
    const double exact = std::sqrt(32.0 * 32 * 2 + 0.25);
    EXPECT_NEAR(glm::length(sphere.centre - glm::dvec3(32, 32, 10.5)), 0, 0.7);
    EXPECT_GE(sphere.radius, exact - 1e-9);
    EXPECT_LE(sphere.radius, exact * 1.03);
}

TEST(FindExtent, SphereIsTightForALopsidedModel) {
    // Three voxels of an obtuse triangle: the smallest sphere stands on its longest side.
    const Sphere sphere = find_extent(make_test_model(6, {{{0, 0, 0}}, {{63, 0, 0}}, {{20, 5, 0}}})).sphere;
    EXPECT_NEAR(glm::length(sphere.centre - glm::dvec3(32, 0.5, 0.5)), 0, 1.0);
    EXPECT_LE(sphere.radius, 31.5 + std::sqrt(0.75) + 1.0);
}

TEST(FindExtent, CornersHoldTheConvexHull) {
    const Model model = lopsided();
    const Extent extent = find_extent(model);
    for (const glm::dvec3 direction : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 2, 0.3), glm::dvec3(0.2, -1, -3)}) {
        double most = -1e9, found = -1e9;
        for (std::uint32_t x = 0; x <= 6; ++x)
            for (std::uint32_t y = 0; y <= 20; ++y)
                for (std::uint32_t z = 0; z <= 6; ++z)
                    most = std::max(most, glm::dot(direction, glm::dvec3(x, y, z)));
        for (int corner = 0; corner < 8; ++corner)
            most = std::max(most, glm::dot(direction, glm::dvec3(3 + (corner & 1), 17 + (corner >> 1 & 1),
                                                                 (corner & 4) != 0 ? 30 : 6)));
        for (const glm::dvec3 &p : extent.corners)
            found = std::max(found, glm::dot(direction, p));
        EXPECT_DOUBLE_EQ(found, most);
    }
}

TEST(FindExtent, LeavesOutSpecksThatAreFarAndFew) {
    std::vector<TestVoxel> voxels;
    for (std::uint32_t y = 0; y < 16; ++y)
        for (std::uint32_t x = 0; x < 16; ++x)
            voxels.push_back({{x, y, 0}});
    const Extent body = find_extent(make_test_model(6, voxels));
    for (std::uint32_t i = 0; i < 3; ++i)
        voxels.push_back({{60 + i, 60, 40}}); // 3 of 259 voxels are less than 1/64 of them
    EXPECT_EQ(find_extent(make_test_model(6, voxels)).corners, body.corners);
    std::vector<TestVoxel> larger = voxels;
    for (std::uint32_t i = 0; i < 3; ++i)
        larger.push_back({{60 + i, 61, 40}});
    EXPECT_GT(find_extent(make_test_model(6, larger)).sphere.radius, 2 * body.sphere.radius);
    std::vector<TestVoxel> near = voxels;
    for (std::uint32_t i = 16; i < 24; ++i)
        near.push_back({{i, 0, 0}}); // a stalk of few voxels that touches the body
    EXPECT_GT(find_extent(make_test_model(6, near)).sphere.radius, body.sphere.radius + 2);
}

TEST(FindExtent, KeepsAllOfAScatteredModel) {
    std::vector<TestVoxel> voxels;
    for (std::uint32_t i = 0; i < 256; ++i) // each a cluster of its own
        voxels.push_back({{i % 8 * 8, i / 8 % 8 * 8, i / 64 * 8}});
    EXPECT_GT(find_extent(make_test_model(6, voxels)).sphere.radius, 40);
}

TEST(DefaultCamera, CentresTheModelAndFillsThePicture) {
    for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z})
        for (const Model &model : {with_up(lopsided(), up), with_up(make_wall(5, 3), up)})
            for (const glm::ivec2 size : kSizes) {
                const Projected box = project(default_camera(model, size.x, size.y), model, size);
                EXPECT_NEAR(box.low.x, -box.high.x, 1e-4);
                EXPECT_NEAR(box.low.y, -box.high.y, 1e-4);
                EXPECT_NEAR(box.reach(), 0.95, 1e-4);
            }
}

TEST(DefaultCamera, IsTheSameForAModelAndItsExtent) {
    const Model model = lopsided();
    const Camera a = default_camera(model, 320, 200);
    const Camera b = default_camera(find_extent(model), model.parameters.grid.up, 320, 200);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.focal_point, b.focal_point);
}

TEST(DefaultCamera, StandsLevelInFrontOfEveryUpAxis) {
    const auto sight = [&](UpAxis up) {
        const Model diagonal = make_test_model(4, {{{0, 0, 0}}, {{9, 9, 9}}});
        const Camera camera = default_camera(with_up(diagonal, up), 100, 100);
        EXPECT_TRUE(is_usable(camera));
        EXPECT_EQ(camera.up, up_direction(up));
        return glm::normalize(camera.position - camera.focal_point);
    };
    EXPECT_NEAR(sight(UpAxis::y).z, 1, 1e-12);
    EXPECT_NEAR(sight(UpAxis::z).y, -1, 1e-12);
    EXPECT_NEAR(sight(UpAxis::x).z, 1, 1e-12);
}

TEST(DefaultCamera, LooksDownAtAFlatModel) {
    const Model terrain = with_up(make_wall(5, 3), UpAxis::z);
    const Camera camera = default_camera(terrain, 100, 100);
    EXPECT_NEAR(glm::normalize(camera.position - camera.focal_point).z, 0.5, 1e-9); // sin 30 degrees
}

TEST(DefaultCamera, IsAsExactForGeoreferencedModels) {
    Model model = lopsided();
    const Camera near = default_camera(model, 320, 200);
    model.parameters.grid.origin = {4.3e6, 5.6e6, 300};
    const Camera far = default_camera(model, 320, 200);
    EXPECT_NEAR(glm::length(far.position - glm::dvec3(4.3e6, 5.6e6, 300) - near.position), 0, 1e-6);
}

TEST(Framed, KeepsTheDirectionAndCentresTheModel) {
    const Model model = lopsided();
    const Extent extent = find_extent(model);
    Camera from;
    from.position = {5, 9, -7};
    from.focal_point = {1, 2, 3};
    from.up = {0.2, 1, 0.1};
    for (const glm::ivec2 size : kSizes) {
        const Camera camera = framed(from, extent, size.x, size.y);
        EXPECT_NEAR(glm::length(eye_axes(camera).forward - eye_axes(from).forward), 0, 1e-9);
        const Projected box = project(camera, model, size);
        EXPECT_NEAR(glm::length(box.low + box.high), 0, 1e-4);
        EXPECT_NEAR(box.reach(), 0.95, 1e-4);
    }
}

TEST(Framed, HoldsForOrthographicCameras) {
    const Model model = lopsided();
    Camera from;
    from.position = {5, 9, -7};
    from.focal_point = {1, 2, 3};
    from.orthographic = true;
    for (const glm::ivec2 size : kSizes) {
        const Camera camera = framed(from, find_extent(model), size.x, size.y);
        EXPECT_TRUE(camera.orthographic);
        const Projected box = project(telecentric(camera, model.parameters.grid.edge()), model, size);
        EXPECT_NEAR(glm::length(box.low + box.high), 0, 0.01);
        EXPECT_NEAR(box.reach(), 0.95, 0.01);
    }
}

TEST(TurntableCamera, KeepsTheModelInThePictureForAWholeTurn) {
    for (const UpAxis up : {UpAxis::y, UpAxis::z})
        for (const Model &model : {with_up(lopsided(), up), with_up(make_wall(5, 3), up)})
            for (const glm::ivec2 size : kSizes) {
                const Camera first = turntable_camera(find_extent(model), up, size.x, size.y);
                const glm::dvec3 axis = up_direction(up);
                double reach = 0;
                for (int i = 0; i < 24; ++i) {
                    const double angle = 2 * std::numbers::pi * i / 24;
                    const glm::dvec3 v = first.position - first.focal_point;
                    Camera camera = first;
                    camera.position = first.focal_point + v * std::cos(angle) + glm::cross(axis, v) * std::sin(angle) +
                                      axis * glm::dot(axis, v) * (1 - std::cos(angle));
                    reach = std::max(reach, project(camera, model, size).reach());
                }
                EXPECT_LE(reach, 0.95 + 1e-9);
                EXPECT_GT(reach, 0.95 - 0.03);
            }
}

} // namespace
} // namespace pbm
