// Round points (BVG.md 18): discs that face the eye, whatever their normals, in every renderer and at every level.
#include "pbm_format/model/point_values.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/bricks/round_points.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/tables/table_renderer.h"
#include "unit/render/test_model.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

namespace pbm {
namespace {

constexpr int kEdge = 96;

std::size_t covered(const Framebuffer &target) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < target.pixels(); ++i)
        count += target.depth[i] < kEmpty;
    return count;
}

// One point in the middle of the cube, whose normal lies along an axis.
Model lone_point(PointShape shape, int axis) {
    TestVoxel voxel{.place = {16, 16, 16}, .normal = {0, 0, 0}, .two_sided = true};
    voxel.normal[static_cast<std::size_t>(axis)] = 1;
    Model model = make_test_model(5, {voxel});
    model.metadata = "{}";
    model.parameters.materials[0] = {.ka = 0.5F, .kd = 0, .ks = 0, .shape = shape};
    return model;
}

Camera camera_at(glm::dvec3 direction, double distance) {
    Camera camera;
    camera.focal_point = glm::dvec3(16.5);
    camera.position = camera.focal_point + distance * glm::normalize(direction);
    camera.up = {0.1, 1, 0.2};
    return camera;
}

using Draw = std::function<Framebuffer(const Model &, const Camera &)>;

template <class Renderer> Framebuffer draw_streamed(const Model &model, const Camera &camera, Storage storage) {
    const Bytes file = value_of(encode_model(model, {.storage = storage, .threads = 1}));
    StreamedModel streamed(value_of(Reader::open(file)));
    const Detail detail = value_of(streamed.load({.camera = camera, .width = kEdge, .height = kEdge}));
    Framebuffer target(kEdge, kEdge);
    Renderer(model.parameters, kDefaultChunkPoints, 1).render(detail.runs, camera, {}, target);
    return target;
}

const std::array<std::pair<std::string, Draw>, 6> kRenderers{{
    {"reference",
     [](const Model &model, const Camera &camera) {
         Framebuffer target(kEdge, kEdge);
         ReferenceRenderer(model).render(camera, {}, target, kMaxDepth);
         return target;
     }},
    {"tables",
     [](const Model &model, const Camera &camera) {
         Framebuffer target(kEdge, kEdge);
         TableRenderer(model).render(camera, {}, target, {.level = kMaxDepth});
         return target;
     }},
    {"kernels",
     [](const Model &model, const Camera &camera) {
         Framebuffer target(kEdge, kEdge);
         TableRenderer(model).render(camera, {}, target, {.level = kMaxDepth, .splats = Splats::kernels});
         return target;
     }},
    {"fast", [](const Model &m, const Camera &c) { return draw_streamed<FastRenderer>(m, c, Storage::packed); }},
    {"fast, mapped",
     [](const Model &m, const Camera &c) { return draw_streamed<FastRenderer>(m, c, Storage::mapped); }},
    {"fine", [](const Model &m, const Camera &c) { return draw_streamed<FineRenderer>(m, c, Storage::packed); }},
}};

TEST(RoundPoints, AreDiscsThatFaceTheEyeFromEverywhere) {
    for (const auto &[name, draw] : kRenderers) {
        if (name == "kernels") // its discs have sizes of powers of two
            continue;
        for (const int axis : {0, 1, 2})
            for (const glm::dvec3 &direction : {glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0.02, 1, 0.01),
                                                glm::dvec3(1, 2, 3), glm::dvec3(-3, -1, 0.5)}) {
                SCOPED_TRACE(name + ", normal " + std::to_string(axis));
                const Camera camera = camera_at(direction, 12);
                const double radius = 0.89 * kEdge / (2 * std::tan(camera.view_angle / 2)) / 12;
                const Framebuffer target = draw(lone_point(PointShape::round, axis), camera);
                EXPECT_NEAR(static_cast<double>(covered(target)), 3.14159 * radius * radius,
                            0.15 * 3.14159 * radius * radius);
            }
    }
    // A disc seen from its edge covers less.
    EXPECT_LT(covered(kRenderers[0].second(lone_point(PointShape::disc, 1), camera_at({1, 0, 0}, 12))), 450U);
}

TEST(RoundPoints, FaceTheEyeAroundIt) {
    for (const auto &[name, draw] : kRenderers) {
        SCOPED_TRACE(name);
        const Framebuffer target = draw(lone_point(PointShape::round, 1), camera_at({1, 0, 0}, 1.5));
        EXPECT_GT(covered(target), std::size_t{kEdge * kEdge / 2});
    }
}

TEST(RoundPoints, AreNeverBlack) {
    for (const auto &[name, draw] : kRenderers) {
        SCOPED_TRACE(name);
        const Framebuffer target = draw(lone_point(PointShape::round, 1), camera_at({0, -1, 0.01}, 5));
        EXPECT_GT(unpack_rgba(target.colour[kEdge * kEdge / 2 + kEdge / 2])[1], 100);
    }
}

TEST(RoundPoints, OtherModelsKeepTheirStreams) {
    const Model model = lone_point(PointShape::disc, 0);
    MarkedPoints marked;
    const PointView points = drawn_points(model, 5, marked);
    EXPECT_TRUE(marked.normals.empty());
    EXPECT_EQ(points.normals.data(), model.levels[5].points.normals.data());
}

// A point far from others has the same radius at every level, but for the steps of the table.
TEST(RoundPoints, DoNotSwellWithTheLevel) {
    constexpr int kDepth = 10;
    for (const double voxels : {0.6, 1.0, 2.0, 6.0}) {
        const double edge = std::ldexp(1.0, -kDepth);
        std::uint8_t stored = radius_index(voxels * edge);
        const double finest = radius_fraction(stored);
        for (int level = kDepth - 1; level >= kDepth - 4; --level) {
            stored = covering_radius(stored, level);
            const double drawn = radius_fraction(drawn_radius(stored, level, kDepth)), node = std::ldexp(1.0, -level);
            EXPECT_LE(drawn, std::max(1.12 * finest, 0.56 * node) + 0.1 * node) << voxels << ' ' << level;
            EXPECT_GE(drawn, 0.85 * finest - 0.2 * node) << voxels << ' ' << level;
        }
        EXPECT_EQ(drawn_radius(stored, kDepth, kDepth), stored);
    }
}

} // namespace
} // namespace pbm
