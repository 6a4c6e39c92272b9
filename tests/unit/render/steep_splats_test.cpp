// Splats of any size and slope are ellipses: none is cut off by the box around it.
#include "pbm_format/model/point_values.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/splats/splat.h"
#include "unit/render/test_model.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace pbm {
namespace {

constexpr int kDepth = 10, kRows = 10, kPixels = 720;
constexpr double kThicker = 3, kWider = 2.5; // what a renderer may add to an ellipse: voxels, pixels
constexpr double kReach = 60;                // pixels, more than half of any

// 10 x 10 points far from each other, with large radii and normals across the line of sight.
struct SteepSplats {
    explicit SteepSplats(unsigned seed) {
        std::mt19937 random(seed);
        const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
        constexpr std::uint32_t kStep = (1U << kDepth) / kRows;
        for (std::uint32_t y = 0; y < kRows; ++y)
            for (std::uint32_t x = 0; x < kRows; ++x) {
                const double around = 6.2831853 * uniform(), slope = 0.2 * std::pow(uniform(), 3);
                voxels.push_back({{x * kStep + kStep / 2, y * kStep + kStep / 2, 1U << (kDepth - 1)},
                                  {std::cos(around), std::sin(around), slope},
                                  true});
            }
        model = make_test_model(kDepth, voxels);
        for (std::uint8_t &radius : model.levels.back().points.radii)
            radius = static_cast<std::uint8_t>(kMaxFinestRadius - random() % 36);
        average_levels(model, 1);
        model.metadata = "{}";
        camera = camera_in_front(glm::dvec3(std::ldexp(0.5, kDepth)), 2200);
    }
    std::vector<TestVoxel> voxels;
    Model model;
    Camera camera;
};

// No pixel that `target` shows lies outside of the exact ellipse of its point, enlarged a little.
void expect_ellipses(const SteepSplats &splats, const Framebuffer &target) {
    const Projection projection(in_unit_grid(splats.camera, splats.model.parameters), kPixels, kPixels);
    const std::vector<ScreenNormal> normals = transform_normals(projection);
    const Level &finest = splats.model.levels.back();
    const double voxel = std::ldexp(1.0, -kDepth);
    struct Ellipse {
        glm::dvec2 middle;
        glm::dmat2 inverse;
    };
    std::vector<Ellipse> ellipses;
    std::vector<MortonCode> codes;
    for (const TestVoxel &at : splats.voxels)
        codes.push_back(morton_encode(at.place[0], at.place[1], at.place[2]));
    std::sort(codes.begin(), codes.end());
    for (std::size_t i = 0; i < finest.points.size(); ++i) {
        const auto [px, py, pz] = morton_decode(codes[i]);
        const glm::dvec3 image = projection.point((glm::dvec3(px, py, pz) + 0.5) * voxel);
        const glm::dvec2 pixel = glm::dvec2(image) / image.z, o = pixel - projection.middle;
        const ScreenNormal &normal = normals[finest.points.normals[i] & kNormalIndexMask];
        const glm::dvec2 n(static_cast<double>(normal.image.x) - pixel.x * static_cast<double>(normal.image.z),
                           static_cast<double>(normal.image.y) - pixel.y * static_cast<double>(normal.image.z));
        const double r2 = std::pow(1.03 * radius_fraction(finest.points.radii[i]), 2);
        const double flat = std::max(r2 - std::pow(kThicker * voxel, 2), 0.0), f2 = projection.focal * projection.focal;
        glm::dmat2 covariance(r2 * (f2 + o.x * o.x) - flat * n.x * n.x, r2 * o.x * o.y - flat * n.x * n.y,
                              r2 * o.x * o.y - flat * n.x * n.y, r2 * (f2 + o.y * o.y) - flat * n.y * n.y);
        covariance /= image.z * image.z;
        covariance[0][0] += kWider * kWider;
        covariance[1][1] += kWider * kWider;
        ellipses.push_back({pixel, glm::inverse(covariance)});
    }
    std::size_t shown = 0, outside = 0;
    for (int y = 0; y < kPixels; ++y)
        for (int x = 0; x < kPixels; ++x) {
            if (!(target.depth[static_cast<std::size_t>(y) * kPixels + static_cast<std::size_t>(x)] < kEmpty))
                continue;
            ++shown;
            outside += std::none_of(ellipses.begin(), ellipses.end(), [&](const Ellipse &ellipse) {
                const glm::dvec2 d = glm::dvec2(x + 0.5, y + 0.5) - ellipse.middle;
                return std::abs(d.x) < kReach && std::abs(d.y) < kReach && glm::dot(d, ellipse.inverse * d) <= 1;
            });
        }
    EXPECT_EQ(outside, 0U);
    EXPECT_GT(shown, finest.points.size() * 20);
}

template <class Renderer> Framebuffer draw(const SteepSplats &splats) {
    const Bytes file = value_of(encode_model(splats.model, {.storage = Storage::mapped, .threads = 1}));
    StreamedModel streamed(value_of(Reader::open(file)));
    const Detail detail =
        value_of(streamed.load({.camera = splats.camera, .width = kPixels, .height = kPixels, .max_error = 0.01}));
    Framebuffer target(kPixels, kPixels);
    Renderer(splats.model.parameters, kDefaultChunkPoints, 1).render(detail.runs, splats.camera, {}, target);
    return target;
}

// 10,000 splats in each renderer.
TEST(SteepSplats, AreEllipsesInEveryRenderer) {
    for (unsigned seed = 0; seed < 100; ++seed) {
        const SteepSplats splats(seed);
        SCOPED_TRACE(seed);
        Framebuffer reference(kPixels, kPixels);
        ReferenceRenderer(splats.model).render(splats.camera, {}, reference, kDepth);
        expect_ellipses(splats, reference);
        expect_ellipses(splats, draw<FastRenderer>(splats));
        expect_ellipses(splats, draw<FineRenderer>(splats));
        if (HasFailure())
            break;
    }
}

} // namespace
} // namespace pbm
