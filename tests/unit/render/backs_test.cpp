// The backs of points: open surfaces are whole from every side, closed ones look as if they had no backs.
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/fine/fine_renderer.h"
#include "unit/render/fast_test_model.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>

namespace pbm {
namespace {

using test::camera_at_ball;
using test::DrawnModel;
using test::smooth_ball;
using test::WholeLevel;

constexpr int kBacksDepth = 7, kBacksWidth = 240, kBacksHeight = 200;

struct NamedRenderer {
    std::string name;
    std::function<Framebuffer(const DrawnModel &, const Camera &)> draw;
    double min_psnr; // of a closed model with its backs
};

Framebuffer draw_fine(const DrawnModel &model, const Camera &camera) {
    Framebuffer target(kBacksWidth, kBacksHeight);
    const WholeLevel level(model.file, model.model.parameters.grid.depth);
    FineRenderer(model.model.parameters, model.chunk_points, 1).render(level.runs, camera, {}, target, 2);
    return target;
}

const std::array<NamedRenderer, 3> &renderers() {
    static const std::array<NamedRenderer, 3> kAll{{{"reference",
                                                     [](const DrawnModel &model, const Camera &camera) {
                                                         return model.reference(camera, kBacksWidth, kBacksHeight, {});
                                                     },
                                                     40},
                                                    {"fast",
                                                     [](const DrawnModel &model, const Camera &camera) {
                                                         return model.fast(camera, kBacksWidth, kBacksHeight, {});
                                                     },
                                                     40},
                                                    {"fine", draw_fine, 45}}};
    return kAll;
}

// The part of a model whose voxels `is_kept` accepts.
template <class IsKept> Model part_of(const Model &whole, const IsKept &is_kept) {
    const auto depth = static_cast<std::size_t>(whole.parameters.grid.depth);
    std::vector<MortonCode> codes{0}, kept;
    for (std::size_t level = 1; level <= depth; ++level)
        codes = value_of(expand_level(codes, whole.levels[level].masks, std::size_t{1} << 30));
    PointAttributes points;
    for (std::size_t i = 0; i < codes.size(); ++i)
        if (is_kept(morton_decode(codes[i]))) {
            kept.push_back(codes[i]);
            points.normals.push_back(whole.levels.back().points.normals[i]);
            points.radii.push_back(whole.levels.back().points.radii[i]);
        }
    Model part = whole;
    part.parameters.closed = false;
    LevelMasks masks = encode_octree(kept, static_cast<int>(depth));
    for (std::size_t level = 0; level < masks.size(); ++level)
        part.levels[level].masks = std::move(masks[level]);
    part.levels.back().points = std::move(points);
    average_levels(part, 1);
    return part;
}

// A ball, and the half of it with low x.
const DrawnModel &ball() {
    static const DrawnModel kBall(smooth_ball(kBacksDepth, {}));
    return kBall;
}
const DrawnModel &bowl() {
    static const DrawnModel kBowl(part_of(ball().model, [](auto place) { return place[0] < 1U << (kBacksDepth - 1); }));
    return kBowl;
}

bool is_drawn(const Framebuffer &picture, int x, int y) {
    return picture.depth[static_cast<std::size_t>(std::ptrdiff_t{y} * picture.width + x)] < kEmpty;
}

bool has_neighbour(const Framebuffer &picture, int x, int y) {
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (x + dx >= 0 && x + dx < picture.width && y + dy >= 0 && y + dy < picture.height &&
                is_drawn(picture, x + dx, y + dy))
                return true;
    return false;
}

// Part of the joint outline, in percent, that only one of two pictures from opposite sides has.
double difference_of_outlines(const Framebuffer &front, const Framebuffer &back) {
    std::size_t joint = 0, alone = 0;
    for (int y = 0; y < kBacksHeight; ++y)
        for (int x = 0; x < kBacksWidth; ++x) {
            const int mirrored = kBacksWidth - 1 - x;
            const bool in_front = is_drawn(front, x, y), in_back = is_drawn(back, mirrored, y);
            joint += in_front || in_back;
            alone += in_front ? !has_neighbour(back, mirrored, y) : in_back && !has_neighbour(front, x, y);
        }
    return 100 * static_cast<double>(alone) / static_cast<double>(joint);
}

TEST(Backs, OfAnOpenSurfaceMakeItWholeFromEverySide) {
    for (const NamedRenderer &renderer : renderers())
        for (const double pixels : {1.0, 1.8, 5.0})
            for (const glm::dvec3 side : {glm::dvec3(1, 0, 0), glm::dvec3(0.6, 0.5, -0.4), glm::dvec3(0.05, 0.2, 1)}) {
                SCOPED_TRACE(renderer.name + " " + std::to_string(pixels));
                Camera camera = camera_at_ball(kBacksDepth, pixels, kBacksHeight, side);
                camera.orthographic = true;
                const Framebuffer front = renderer.draw(bowl(), camera);
                camera.position = 2.0 * camera.focal_point - camera.position;
                EXPECT_LE(difference_of_outlines(front, renderer.draw(bowl(), camera)), 1.0);
            }
}

TEST(Backs, AreNotThereIfTheyAreHidden) {
    Camera camera = camera_at_ball(kBacksDepth, 1.5, kBacksHeight, {1, 0, 0});
    camera.backs = Backs::hide;
    const std::size_t middle = kBacksHeight / 2 * kBacksWidth + kBacksWidth / 2;
    for (const NamedRenderer &renderer : renderers()) {
        EXPECT_EQ(renderer.draw(bowl(), camera).depth[middle], kEmpty) << renderer.name;
        Camera shown = camera;
        shown.backs = Backs::automatic;
        EXPECT_NEAR(renderer.draw(bowl(), shown).depth[middle], glm::length(camera.position - camera.focal_point) + 0.9,
                    0.02)
            << renderer.name;
    }
}

double psnr(const Framebuffer &a, const Framebuffer &b) {
    double sum = 0;
    std::size_t drawn = 0;
    for (std::size_t i = 0; i < a.pixels(); ++i) {
        drawn += a.depth[i] < kEmpty || b.depth[i] < kEmpty;
        const Rgba8 left = unpack_rgba(a.colour[i]), right = unpack_rgba(b.colour[i]);
        for (std::size_t channel = 0; channel < 3; ++channel)
            sum += std::pow(static_cast<double>(left[channel]) - static_cast<double>(right[channel]), 2);
    }
    return 10 * std::log10(3 * 255.0 * 255.0 * static_cast<double>(drawn) / std::max(sum, 1e-9));
}

TEST(Backs, OfAClosedSurfaceHardlyChangeItsPicture) {
    for (const NamedRenderer &renderer : renderers())
        for (const double pixels : {0.8, 1.4, 1.9, 4.0}) {
            Camera camera = camera_at_ball(kBacksDepth, pixels, kBacksHeight);
            camera.backs = Backs::hide;
            const Framebuffer hidden = renderer.draw(ball(), camera);
            camera.backs = Backs::show;
            EXPECT_GE(psnr(hidden, renderer.draw(ball(), camera)), renderer.min_psnr) << renderer.name << " " << pixels;
        }
}

// The eye comes near to the surface and passes through it.
TEST(NearSplats, CoverThePictureHoweverNearTheEyeIs) {
    const glm::dvec3 middle(0, -1, -2);
    const double voxel = std::ldexp(2.0, -kBacksDepth);
    for (const NamedRenderer &renderer : renderers())
        for (const double voxels : {4.0, 2.6, 1.5, 0.7, 0.3}) {
            Camera camera;
            camera.position = middle + glm::dvec3(0, 0, 0.9 + voxels * voxel);
            camera.focal_point = middle;
            const Framebuffer picture = renderer.draw(ball(), camera);
            std::size_t empty = 0;
            for (std::size_t i = 0; i < picture.pixels(); ++i)
                empty += picture.depth[i] == kEmpty;
            EXPECT_EQ(empty, 0U) << renderer.name << " " << voxels;
            EXPECT_NEAR(picture.depth[kBacksHeight / 2 * kBacksWidth + kBacksWidth / 2], voxels * voxel, 0.8 * voxel)
                << renderer.name << " " << voxels;
        }
}

} // namespace
} // namespace pbm
