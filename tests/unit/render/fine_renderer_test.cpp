// The fine renderer: smooth surfaces, soft edges, and no colour of points behind the surface.
#include "pbm_render/fine/fine_renderer.h"

#include "unit/render/fast_test_model.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <hwy/targets.h>

namespace pbm {
namespace {

using test::camera_at_ball;
using test::every_attribute;
using test::smooth_ball;

struct FileOfModel {
    explicit FileOfModel(Model m)
        : model(std::move(m)),
          bytes(value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 4096, .threads = 1}))) {}

    Framebuffer draw(const Camera &camera, int width, int height, const RenderOptions &options,
                     int samples = kDefaultSamples, int threads = 1) const {
        Framebuffer target(width, height);
        const test::WholeLevel level(bytes, model.parameters.grid.depth);
        FineRenderer(model.parameters, 4096, threads).render(level.runs, camera, options, target, samples);
        return target;
    }

    Model model;
    Bytes bytes;
};

double linear(std::uint32_t pixel, std::size_t channel) {
    return linear_table()[unpack_rgba(pixel)[channel]] / 65535.0;
}

// White where `is_white`, else black; ambient light only, so that lights do not change it.
template <class IsWhite> Model paint(Model model, IsWhite &&is_white) {
    ModelParameters &parameters = model.parameters;
    model.metadata = "{}";
    parameters.attributes.colour = ColourFormat::rgb888;
    parameters.materials[0] = {.ka = 1, .kd = 0, .ks = 0};
    std::vector<Bytes> masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    PointAttributes &points = model.levels.back().points;
    points.colours.resize(3 * points.size());
    std::size_t i = 0;
    const auto paint_below = [&](auto &&self, MortonCode code, int level, std::vector<std::size_t> &next) -> void {
        if (level == parameters.grid.depth) {
            const std::uint8_t value = is_white(morton_decode(code)) ? 255 : 0;
            set_point_colour(points, i++, ColourFormat::rgb888, {value, value, value});
            return;
        }
        const std::uint8_t mask = masks[static_cast<std::size_t>(level) + 1][next[static_cast<std::size_t>(level)]++];
        for (MortonCode child = 0; child < 8; ++child)
            if ((mask >> child & 1) != 0)
                self(self, code << 3 | child, level + 1, next);
    };
    std::vector<std::size_t> next(masks.size());
    paint_below(paint_below, 0, 0, next);
    average_levels(model, 1);
    return model;
}

// Recovers the normals of a ball from its colours: each channel shows one axis.
TEST(FineRenderer, ShowsNormalsOfABallWithinADegree) {
    Model model = smooth_ball(7, {});
    model.parameters.materials[0] = {.ka = 0, .kd = 1, .ks = 0, .colour = {255, 255, 255}};
    model.parameters.lights = {{.intensity = {1, 0, 0}, .direction = {-1, 0, 0}},
                               {.intensity = {0, 1, 0}, .direction = {0, -1, 0}},
                               {.intensity = {0, 0, 1}, .direction = {0, 0, -1}}};
    const FileOfModel ball(std::move(model));
    for (const double pixels : {0.8, 2.0, 6.0}) {
        const Camera camera = camera_at_ball(7, pixels, 150, {1, 1, 1});
        const Framebuffer picture = ball.draw(camera, 200, 150, {}, 4);
        const Projection projection(camera, 200, 150);
        const glm::dvec3 to_middle = glm::dvec3(0, -1, -2) - projection.eye;
        std::size_t compared = 0;
        double worst = 0, sum = 0;
        for (std::size_t i = 0; i < picture.pixels(); ++i) {
            const glm::dvec3 ray = glm::normalize(projection.ray(glm::dvec2(picture.centre(i))));
            const double along = glm::dot(to_middle, ray);
            const double inside = 0.81 - (glm::dot(to_middle, to_middle) - along * along);
            if (inside < 0.3)
                continue;
            const glm::dvec3 normal = glm::normalize(ray * (along - std::sqrt(inside)) - to_middle);
            if (std::min({normal.x, normal.y, normal.z}) < 0.1)
                continue;
            const glm::dvec3 seen(linear(picture.colour[i], 0), linear(picture.colour[i], 1),
                                  linear(picture.colour[i], 2));
            const double degrees =
                std::acos(std::min(1.0, glm::dot(normal, glm::normalize(seen)))) / std::acos(-1.0) * 180;
            worst = std::max(worst, degrees);
            sum += degrees;
            ++compared;
        }
        ASSERT_GT(compared, 1000U) << pixels;
        EXPECT_LT(worst, 1.6) << pixels << " pixels per voxel";
        EXPECT_LT(sum / static_cast<double>(compared), 0.6) << pixels << " pixels per voxel";
    }
}

TEST(FineRenderer, BlendsColoursWithinTwoVoxels) {
    const FileOfModel wall(paint(make_wall(6, 20), [](auto place) { return place[0] >= 32; }));
    constexpr int kWidth = 160, kHeight = 40;
    constexpr double kPixels = 8; // per voxel
    Camera camera = camera_in_front({32, 32, 20.5}, 400);
    camera.view_angle = 2 * std::atan(kHeight / kPixels / 2 / 400);
    const Framebuffer picture = wall.draw(camera, kWidth, kHeight, {}, 4);
    for (std::size_t y = 0; y < kHeight; ++y) {
        double before = 0;
        for (std::size_t x = 0; x < kWidth; ++x) {
            const double value = linear(picture.colour[y * kWidth + x], 0);
            const double voxels = (static_cast<double>(x) + 0.5 - kWidth / 2.0) / kPixels; // distance from the border
            if (std::abs(voxels) > 2) {
                ASSERT_DOUBLE_EQ(value, voxels > 0 ? 1 : 0) << x << " " << y;
            }
            ASSERT_GE(value, before - 0.02) << x << " " << y;
            if (std::abs(voxels) < 0.1) {
                ASSERT_NEAR(value, 0.5, 0.15) << x << " " << y;
            }
            before = value;
        }
    }
}

TEST(FineRenderer, ShowsNothingBehindTheSurface) {
    const auto wall = [](bool with_back) {
        std::vector<TestVoxel> voxels;
        for (std::uint32_t y = 0; y < 32; ++y)
            for (std::uint32_t x = 0; x < 32; ++x) {
                voxels.push_back({{x, y, 16}});
                if (with_back)
                    voxels.push_back({{x, y, 13}});
            }
        return FileOfModel(paint(make_test_model(5, std::move(voxels)), [](auto place) { return place[2] < 16; }));
    };
    const FileOfModel alone = wall(false), before_another = wall(true);
    for (const double pixels : {0.7, 3.0, 9.0}) {
        Camera camera = camera_in_front({16, 16, 16.5}, 200);
        camera.view_angle = 2 * std::atan(60 / pixels / 2 / 200);
        const Framebuffer expected = alone.draw(camera, 80, 60, {}, 3);
        const Framebuffer picture = before_another.draw(camera, 80, 60, {}, 3);
        for (std::size_t i = 0; i < picture.pixels(); ++i) {
            const glm::vec2 from_middle = glm::abs(picture.centre(i) - glm::vec2(40, 30));
            if (std::max(from_middle.x, from_middle.y) < 14 * static_cast<float>(pixels)) {
                ASSERT_EQ(picture.colour[i], expected.colour[i]) << i << ", " << pixels << " pixels per voxel";
            }
        }
    }
}

// Transparent background: border pixels keep the wall's colour, and only alpha falls.
TEST(FineRenderer, MakesSoftEdgesOfStraightAlpha) {
    const FileOfModel wall(paint(make_wall(5, 16), [](auto) { return true; }));
    Camera camera = camera_in_front({16, 16, 16.5}, 200);
    camera.view_angle = 2 * std::atan(40 / 2.0 / 200); // one pixel per voxel
    const Framebuffer picture = wall.draw(camera, 61, 40, {.background = {0, 0, 0, 0}}, 16);
    std::size_t partly = 0;
    for (std::size_t y = 10; y < 30; ++y) {
        unsigned before = 255;
        for (std::size_t x = 30; x < 61; ++x) {
            const Rgba8 pixel = unpack_rgba(picture.colour[y * 61 + x]);
            EXPECT_LE(pixel[3], before) << x << " " << y;
            before = pixel[3];
            partly += before > 0 && before < 255;
            if (before > 0) {
                EXPECT_EQ(pixel[0], 255) << x << " " << y;
            } else {
                EXPECT_EQ(picture.colour[y * 61 + x], 0U);
            }
        }
        EXPECT_EQ(before, 0U);
    }
    EXPECT_GE(partly, 20U);
}

// Measured by the area that the ball covers. Surface offsets put its outline 0.1 voxels outside; without kFineInset it
// would lie 0.2 voxels outside. All of that would open relief that is finer than a voxel.
TEST(FineRenderer, PutsTheOutlineOfABallATenthOfAVoxelOutside) {
    const FileOfModel ball(smooth_ball(7, {}));
    constexpr int kSize = 260;
    for (const double pixels : {1.0, 2.0}) {
        const Camera camera = camera_at_ball(7, pixels, kSize);
        const Framebuffer picture = ball.draw(camera, kSize, kSize, {.background = {0, 0, 0, 0}});
        double covered = 0; // pixels
        for (const std::uint32_t pixel : picture.colour)
            covered += unpack_rgba(pixel)[3] / 255.0;
        const double distance = glm::length(camera.position - camera.focal_point);
        const double focal = kSize / (2 * std::tan(camera.view_angle / 2));
        const double radius = focal * 0.9 / std::sqrt(distance * distance - 0.81); // pixels
        EXPECT_NEAR((std::sqrt(covered / std::acos(-1.0)) - radius) / pixels, 0.13, 0.05) << pixels;
    }
}

TEST(FineRenderer, GivesTheSamePictureForAnyThreadsAndSimdTargets) {
    Model model = smooth_ball(6, every_attribute(ColourFormat::rgb565, 6), 5);
    model.parameters.lights[1].kind = LightKind::spot;
    model.parameters.lights[1].position = {2, 3, 1};
    model.parameters.lights[1].exponent = 3;
    const FileOfModel ball(std::move(model));
    const auto pictures = [&](int threads) {
        std::vector<std::uint32_t> all;
        for (const double pixels : {0.9, 3.0, 12.0}) { // blocks, small ellipses, large ellipses
            const Framebuffer picture = ball.draw(camera_at_ball(6, pixels, 150), 1501, 150, {}, 2, threads);
            all.insert(all.end(), picture.colour.begin(), picture.colour.end());
        }
        return all;
    };
    const std::vector<std::uint32_t> expected = pictures(1);
    for (const int threads : {2, 5})
        EXPECT_EQ(pictures(threads), expected) << threads << " threads";
    for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
        hwy::SetSupportedTargetsForTest(targets & -targets);
        EXPECT_EQ(pictures(1), expected) << hwy::TargetName(targets & -targets);
    }
    hwy::SetSupportedTargetsForTest(0);
}

// Wide pictures have strips of 16 rows, narrow ones a single strip: no strip may miss points of its neighbours.
TEST(FineRenderer, GivesTheSameRowsWhateverTheHeightOfStrips) {
    constexpr int kWide = 2304, kNarrow = 256, kHeight = 96, kBeside = (kWide - kNarrow) / 2;
    const FileOfModel ball(
        paint(smooth_ball(7, {}), [](auto place) { return ((place[0] ^ place[1] ^ place[2]) >> 1 & 1) != 0; }));
    for (const double pixels : {0.7, 1.4, 3.0, 9.0}) {
        const Camera camera = camera_at_ball(7, pixels, kHeight, {1, 2, 3});
        const Framebuffer wide = ball.draw(camera, kWide, kHeight, {}, 2),
                          narrow = ball.draw(camera, kNarrow, kHeight, {}, 2);
        const auto row_of = [](const Framebuffer &picture, int y) {
            return picture.colour.data() + static_cast<std::ptrdiff_t>(y) * picture.width;
        };
        int different = 0; // by more than rounding
        for (int y = 0; y < kHeight; ++y)
            for (int x = 1; x < kNarrow - 1; ++x) { // of the outermost ones the narrow picture knows one neighbour less
                const auto a = unpack_rgba(row_of(wide, y)[kBeside + x]), b = unpack_rgba(row_of(narrow, y)[x]);
                for (std::size_t channel = 0; channel < 4; ++channel)
                    if (std::abs(a[channel] - b[channel]) > 1) {
                        ++different;
                        break;
                    }
            }
        EXPECT_LE(different, 4) << pixels << " pixels per voxel";
    }
}

TEST(FineRenderer, ComesSampleBySample) {
    const FileOfModel ball(smooth_ball(6, {}));
    const Camera camera = camera_at_ball(6, 2, 60);
    const test::WholeLevel level(ball.bytes, 6);
    FineRenderer renderer(ball.model.parameters, 4096, 1);
    Framebuffer target(80, 60);
    for (int round = 0; round < 2; ++round) { // the second picture must not depend on the first
        renderer.begin(level.runs, camera, {}, target);
        EXPECT_EQ(renderer.samples(), 0);
        for (int samples = 1; samples <= 4; ++samples) {
            EXPECT_GT(renderer.add_samples(1).drawn_points, 0U);
            EXPECT_EQ(renderer.samples(), samples);
            renderer.resolve(target);
            const Framebuffer whole = ball.draw(camera, 80, 60, {}, samples);
            ASSERT_EQ(target.colour, whole.colour) << samples;
            ASSERT_EQ(target.depth, whole.depth) << samples;
        }
    }
}

// The second sample of each pixel is the first one of a picture whose camera has moved by a part of a pixel.
TEST(FineRenderer, AddsToBordersWhatAShiftedPictureShows) {
    constexpr double kOffsetX = -0.245122, kOffsetY = -0.430160; // of the second sample, pixels
    const FileOfModel ball(smooth_ball(6, every_attribute(ColourFormat::rgb888, 6), 5));
    const test::WholeLevel level(ball.bytes, 6);
    for (const double pixels : {1.0, 2.0, 5.0}) {
        const int edge = static_cast<int>(70 * pixels); // of the picture, which shows all of the ball
        Camera camera = camera_at_ball(6, pixels, edge);
        camera.orthographic = true;
        const glm::dvec3 forward = glm::normalize(camera.focal_point - camera.position),
                         right = glm::normalize(glm::cross(forward, camera.up)), down = glm::cross(forward, right);
        const double pixel = std::ldexp(2.0, -6) / pixels; // model units
        Camera shifted = camera;
        for (glm::dvec3 *const place : {&shifted.position, &shifted.focal_point})
            *place += pixel * (kOffsetX * right + kOffsetY * down);
        const auto draw = [&](const Camera &from, int samples) {
            Framebuffer target(edge, edge);
            std::vector<Float4> light(target.pixels());
            FineRenderer renderer(ball.model.parameters, 4096, 1);
            renderer.begin(level.runs, from, {.background = {0, 0, 0, 0}}, target);
            renderer.add_samples(samples);
            renderer.resolve(light);
            return light;
        };
        const std::vector<Float4> first = draw(camera, 1), second = draw(shifted, 1), both = draw(camera, 2);
        std::size_t borders = 0, different = 0;
        for (std::size_t i = 0; i < both.size(); ++i) {
            const Float4 mean = (first[i] + second[i]) / 2;
            if (mean[3] != 0.5F)
                continue;
            ++borders;
            for (int channel = 0; channel < 4; ++channel)
                if (std::abs(both[i][channel] - mean[channel]) > 0.01F) {
                    ++different;
                    break;
                }
        }
        EXPECT_GT(borders, 25U) << pixels;
        EXPECT_LE(different, borders / 20) << pixels << " pixels per voxel, " << borders << " at borders";
    }
}

TEST(FineRenderer, LeavesASampleThatIsStopped) {
    const FileOfModel ball(smooth_ball(6, {}));
    const Camera camera = camera_at_ball(6, 2, 60);
    const test::WholeLevel level(ball.bytes, 6);
    FineRenderer renderer(ball.model.parameters, 4096, 1);
    Framebuffer target(80, 60);
    std::atomic<bool> stop = true;
    renderer.begin(level.runs, camera, {}, target);
    EXPECT_EQ(renderer.add_samples(1, &stop).drawn_points, 0U);
    EXPECT_EQ(renderer.samples(), 0);
    stop = false;
    renderer.begin(level.runs, camera, {}, target);
    EXPECT_GT(renderer.add_samples(1, &stop).drawn_points, 0U);
    renderer.resolve(target);
    EXPECT_EQ(target.colour, ball.draw(camera, 80, 60, {}, 1).colour);
}

TEST(FineRenderer, ShadesAsTheFastRendererOnAverage) {
    const Model model = smooth_ball(7, every_attribute(ColourFormat::rgb888, 7));
    const test::DrawnModel drawn(model);
    const FileOfModel ball(model);
    const Camera camera = camera_at_ball(7, 1, 90);
    for (const RenderOptions &options :
         {RenderOptions{}, RenderOptions{.texture = false}, RenderOptions{.texture = false, .point_colours = false},
          RenderOptions{.shadows = false}}) {
        const Framebuffer fine = ball.draw(camera, 120, 90, options);
        const Framebuffer fast = drawn.fast(camera, 120, 90, options);
        std::array<double, 3> difference{};
        std::size_t count = 0;
        for (std::size_t i = 0; i < fine.pixels(); ++i) {
            if (std::isinf(fine.depth[i]) || std::isinf(fast.depth[i]))
                continue;
            for (std::size_t k = 0; k < 3; ++k)
                difference[k] += linear(fine.colour[i], k) - linear(fast.colour[i], k);
            ++count;
        }
        ASSERT_GT(count, 3000U);
        for (const double sum : difference)
            EXPECT_NEAR(sum / static_cast<double>(count), 0, 0.01);
    }
}

TEST(FineRenderer, DrawsNothingButTheBackgroundWithoutPoints) {
    const FileOfModel ball(smooth_ball(5, {}));
    Framebuffer target(5, 3, false);
    FineRenderer renderer(ball.model.parameters, 4096, 1);
    const RenderStatistics drawn = renderer.render({}, {}, {.background = {10, 20, 30, 40}}, target);
    EXPECT_EQ(drawn.points, 0U);
    for (const std::uint32_t pixel : target.colour)
        EXPECT_EQ(pixel, pack_rgba({10, 20, 30, 40}));
}

} // namespace
} // namespace pbm
