// The fast renderer against the reference renderer, and its determinism.
#include "pbm_render/fast/fast_renderer.h"

#include "pbm_render/detail/streamed_model.h"
#include "unit/render/fast_test_model.h"
#include "unit/support/value_of.h"

#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <hwy/targets.h>

namespace pbm {
namespace {

using test::camera_at_ball;
using test::DrawnModel;
using test::every_attribute;
using test::smooth_ball;

constexpr int kWidth = 320, kHeight = 240;

DrawnModel make_ball(bool placed, std::uint32_t chunk_points = 4096) {
    Model ball = smooth_ball(7, {.colour = ColourFormat::rgb888});
    ball.parameters.lights = default_lights(UpAxis::y); // stay with the model
    DrawnModel model(std::move(ball), chunk_points);
    model.placed = placed;
    return model;
}
const DrawnModel &ball() {
    static const DrawnModel kModel = make_ball(true);
    return kModel;
}
// The same ball, drawn without surface offsets.
const DrawnModel &plain_ball() {
    static const DrawnModel kModel = make_ball(false);
    return kModel;
}

// Difference of two pictures. `both`: pixels that both cover.
struct Difference {
    std::size_t lost = 0, added = 0, both = 0; // pixels that only the first, only the second, both cover
    std::size_t open = 0;                      // lost pixels that lie three pixels or more inside of the first
    double depth = 0, max_depth = 0;           // model units, mean and maximum
    double colour = 0;                         // mean difference of a channel
    std::size_t other_colours = 0;             // pixels where a channel differs by more than 3
};

// Whether a picture covers all pixels up to two pixels from pixel `at`.
bool is_inside(const Framebuffer &picture, std::size_t at) {
    const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
    const std::size_t x = at % width, y = at / width;
    for (std::size_t row = y - std::min<std::size_t>(y, 2); row < std::min(y + 3, height); ++row)
        for (std::size_t column = x - std::min<std::size_t>(x, 2); column < std::min(x + 3, width); ++column)
            if (picture.depth[row * width + column] == kEmpty)
                return false;
    return true;
}

Difference compare(const Framebuffer &expected, const Framebuffer &drawn) {
    Difference d;
    for (std::size_t i = 0; i < expected.pixels(); ++i) {
        const bool before = expected.depth[i] != kEmpty, now = drawn.depth[i] != kEmpty;
        d.lost += before && !now;
        d.added += now && !before;
        d.open += before && !now && is_inside(expected, i);
        if (!before || !now)
            continue;
        ++d.both;
        const double depth = std::abs(double{expected.depth[i]} - double{drawn.depth[i]});
        d.depth += depth;
        d.max_depth = std::max(d.max_depth, depth);
        const Rgba8 a = unpack_rgba(expected.colour[i]), b = unpack_rgba(drawn.colour[i]);
        int most = 0;
        for (std::size_t channel = 0; channel < 4; ++channel) {
            const int difference = std::abs(int{a[channel]} - int{b[channel]});
            d.colour += difference / 4.0;
            most = std::max(most, difference);
        }
        d.other_colours += most > 3;
    }
    if (d.both > 0) {
        d.depth /= static_cast<double>(d.both);
        d.colour /= static_cast<double>(d.both);
    }
    return d;
}

std::string text(const Difference &d) {
    return "lost " + std::to_string(d.lost) + ", open " + std::to_string(d.open) + ", added " +
           std::to_string(d.added) + ", both " + std::to_string(d.both) + ", depth " + std::to_string(d.depth) +
           " <= " + std::to_string(d.max_depth) + ", colour " + std::to_string(d.colour) + ", other colours " +
           std::to_string(d.other_colours);
}

Difference difference(const DrawnModel &model, const Camera &camera, int width = kWidth, int height = kHeight,
                      const RenderOptions &options = {}, int level = kMaxDepth) {
    return compare(model.reference(camera, width, height, options, level),
                   model.fast(camera, width, height, options, level));
}

// Limits of the difference where a voxel of `level` is `pixels` wide. Blocks extend up to a pixel beyond ellipses.
// Where voxels are smaller than pixels, the renderers may choose different points for a pixel.
void expect_alike(const Difference &d, int level, double pixels, const std::string &what) {
    SCOPED_TRACE(what + ", " + std::to_string(pixels) + " pixels: " + text(d));
    const double voxel = std::ldexp(2.0, -level), both = static_cast<double>(d.both);
    const bool blocks = pixels < 1.5;
    EXPECT_GT(d.both, 0U);
    EXPECT_LE(static_cast<double>(d.lost), (blocks ? 0.001 : 0.0006) * both);
    EXPECT_LE(static_cast<double>(d.added), blocks ? std::sqrt(4 * 3.1416 * both) : 20);
    EXPECT_LE(d.depth, voxel * (blocks ? 0.35 / (pixels * pixels) : 0.035));
    // The reference renderer rounds linear light to 4,096 steps before it converts it to sRGB.
    EXPECT_LE(d.colour, blocks ? 0.9 / (pixels * pixels) : 0.25);
}

const std::vector<glm::dvec3> &directions() {
    static const std::vector<glm::dvec3> all{{0.3, 0.5, 0.8}, {1, 0, 0}, {-0.6, -0.2, -0.7}};
    return all;
}

struct Pixels {
    std::vector<std::uint32_t> colour;
    std::vector<std::uint32_t> depth; // bit patterns, so that +infinity compares equal
    bool operator==(const Pixels &) const = default;
};
Pixels pixels_of(const Framebuffer &target) {
    Pixels pixels;
    for (std::size_t i = 0; i < target.pixels(); ++i) {
        pixels.colour.push_back(target.colour[i]);
        pixels.depth.push_back(std::bit_cast<std::uint32_t>(target.depth[i]));
    }
    return pixels;
}

TEST(FastRenderer, ShowsWhatTheReferenceShowsAsBlocks) {
    for (const double pixels : {0.4, 0.7, 1.0, 1.18}) // a fifth wider in front of the ball's centre
        for (const glm::dvec3 &direction : directions()) {
            const Camera camera = camera_at_ball(7, pixels, kHeight, direction);
            expect_alike(difference(ball(), camera), 7, pixels, "blocks");
            expect_alike(difference(plain_ball(), camera), 7, pixels, "blocks without offsets");
        }
}

TEST(FastRenderer, ShowsWhatTheReferenceShowsAsLargerBlocks) {
    for (const double pixels : {1.4, 1.5, 1.6})
        for (const glm::dvec3 &direction : directions())
            for (const DrawnModel *model : {&ball(), &plain_ball()}) {
                const Camera camera = camera_at_ball(7, pixels, kHeight, direction);
                const Difference d = difference(*model, camera);
                SCOPED_TRACE(std::to_string(pixels) + " pixels: " + text(d));
                EXPECT_EQ(d.open, 0U);
                EXPECT_LE(static_cast<double>(d.lost), 0.003 * static_cast<double>(d.both)); // at the outline
                EXPECT_LE(static_cast<double>(d.added), std::sqrt(4 * 3.1416 * static_cast<double>(d.both)));
                EXPECT_LE(d.depth, 0.3 * std::ldexp(2.0, -7));
                EXPECT_LE(d.colour, 0.7);
            }
}

TEST(FastRenderer, ShowsWhatTheReferenceShowsAsEllipses) {
    for (const double pixels : {2.6, 4.0, 9.0, 40.0})
        for (const glm::dvec3 &direction : directions()) {
            const Camera camera = camera_at_ball(7, pixels, kHeight, direction);
            expect_alike(difference(ball(), camera), 7, pixels, "ellipses");
            expect_alike(difference(plain_ball(), camera), 7, pixels, "ellipses without offsets");
        }
}

TEST(FastRenderer, ShowsEveryLevelAsTheReferenceDoes) {
    for (int level = 1; level <= 6; ++level)
        for (const double pixels : {5.0, 30.0}) {
            const Difference d = difference(ball(), camera_at_ball(level, pixels, kHeight), kWidth, kHeight, {}, level);
            const std::string what = "level " + std::to_string(level) + ": " + text(d);
            // On a ball a few voxels wide splats intersect steeply: rounding decides which one is visible.
            const bool steep = level <= 2;
            EXPECT_GT(d.both, 50U) << what;
            EXPECT_LE(static_cast<double>(d.lost + d.added), 0.0018 * static_cast<double>(d.both) + (steep        ? 20
                                                                                                     : level == 3 ? 4
                                                                                                                  : 3))
                << what;
            EXPECT_LE(d.depth, 0.04 * std::ldexp(2.0, -level)) << what;
            EXPECT_LE(d.colour, steep ? 0.8 : 0.5) << what;
        }
}

TEST(FastRenderer, ShowsPicturesOfAnySize) {
    struct Size {
        int width, height;
    };
    for (const auto &[width, height] : {Size{1, 1}, Size{1, 90}, Size{90, 1}, Size{17, 3}, Size{3, 17}, Size{101, 67},
                                        Size{2000, 40}, Size{33, 3000}})
        for (const double pixels : {1.3, 6.0}) {
            const Difference d = difference(ball(), camera_at_ball(7, pixels, height), width, height);
            const std::string what = std::to_string(width) + "x" + std::to_string(height) + ": " + text(d);
            EXPECT_GT(d.both, 0U) << what;
            EXPECT_LE(d.lost, 1U) << what;
            EXPECT_LE(d.added, 50U) << what;
            EXPECT_LE(d.depth, 0.25 * std::ldexp(2.0, -7)) << what;
            EXPECT_LE(d.colour, 0.5) << what;
        }
}

struct Look {
    const char *what;
    glm::dvec3 eye, at;
    double angle; // degrees
};
std::vector<Look> looks() {
    return {{"inside", {0, -1, -2}, {0, -1, -3}, 30},
            {"inside, wide", {0.1, -1.2, -2}, {0, 0, 0}, 120},
            {"turned away", {0, -1, 2}, {0, -1, 3}, 30},
            {"on the surface", {0, -1, -1.09}, {0, -1, -3}, 60},
            {"very near", {0.02, -1, -1.05}, {0, -1, -2}, 30},
            {"past it", {0, -1, 1}, {1.05, -1, -2}, 30},
            {"beside it", {0, -1, 1}, {5, -1, -2}, 20},
            {"wide", {0, -1, -0.9}, {0, -1, -2}, 150},
            {"widest", {0, -1, -0.9}, {0, -1, -2}, 179},
            {"narrow", {0, -1, 300}, {0, -1, -2}, 0.2},
            {"narrowest", {0, -1, 30000}, {0.1, -1, -2}, 0.001},
            {"far", {0, -1, 1e6}, {0, -1, -2}, 30}};
}
Camera camera_of(const Look &look) {
    Camera camera;
    camera.position = look.eye;
    camera.focal_point = look.at;
    camera.view_angle = glm::radians(look.angle);
    return camera;
}

TEST(FastRenderer, LooksFromAnywhere) {
    const DrawnModel two_sided(smooth_ball(7, {.colour = ColourFormat::rgb888}, 1));
    for (const DrawnModel *model : {&ball(), &plain_ball(), &two_sided})
        for (const Look &look : looks()) {
            const Difference d = difference(*model, camera_of(look));
            const std::string what = std::string(look.what) + ": " + text(d);
            const double range = std::max(1.0, glm::length(look.eye - glm::dvec3(0, -1, -2)));
            EXPECT_LE(static_cast<double>(d.lost), 0.0003 * static_cast<double>(d.both) + 12) << what;
            EXPECT_LE(d.added, 10U) << what;
            EXPECT_LE(d.depth, d.both > 100 ? 0.001 : 0.01 * range + 1) << what;
            EXPECT_LE(d.colour, d.both > 100 ? 0.5 : 80) << what;
        }
    Camera inside = camera_of(looks()[0]);
    EXPECT_EQ(difference(ball(), inside).both, std::size_t{kWidth * kHeight});
    inside.backs = Backs::hide;
    EXPECT_EQ(difference(ball(), inside).both, 0U); // all points face away
    EXPECT_EQ(difference(two_sided, camera_of(looks()[0])).both, std::size_t{kWidth * kHeight});
}

TEST(FastRenderer, DrawsOrthographicViewsAsTheReferenceDoes) {
    for (const double pixels : {2.6, 12.0, 60.0}) {
        Camera camera = camera_at_ball(7, pixels, kHeight);
        camera.orthographic = true;
        const Difference d = difference(ball(), camera);
        const std::string what = std::to_string(pixels) + " pixels: " + text(d);
        EXPECT_GT(d.both, 3000U) << what;
        EXPECT_LE(d.lost + d.added, 12U) << what;
        EXPECT_LE(d.depth, 0.002) << what;
        EXPECT_LE(d.colour, 0.5) << what;
    }
}

// A plane cuts through the middle of the ball, a box out a piece of the side that is seen.
TEST(FastRenderer, CutsModelsOpenAsTheReferenceDoes) {
    const glm::dvec3 middle(0, -1, -2);
    for (const double pixels : {1.3, 6.0, 40.0})
        for (const glm::dvec3 &direction : directions())
            for (const DrawnModel *model : {&ball(), &plain_ball()}) {
                Camera camera = camera_at_ball(7, pixels, kHeight, direction);
                const std::size_t whole = difference(*model, camera).both;
                camera.clip.plane = {middle, glm::dvec3(0.2, -0.3, 0.4) - direction};
                if (pixels > 2) {
                    expect_alike(difference(*model, camera), 7, pixels, "plane");
                } else { // blocks cover pixels of the far inside beyond the rim
                    const Difference d = difference(*model, camera);
                    EXPECT_LE(d.lost, 16U) << text(d);
                    EXPECT_LE(d.depth, 0.006) << text(d);
                    EXPECT_LE(d.colour, 0.6) << text(d);
                }
                camera.clip = {};
                const double half = std::ldexp(2.0, -7) / pixels * kHeight * 0.1;
                const glm::dvec3 seen = middle + 0.9 * glm::normalize(direction);
                camera.clip.box = {seen - half, seen + half};
                const Difference d = difference(*model, camera);
                expect_alike(d, 7, pixels, "box");
                EXPECT_LT(d.both, whole);
            }
}

TEST(FastRenderer, ShowsTheInsideOfWhatIsCutOpen) {
    Camera camera = camera_at_ball(7, 4, kHeight, {0, 0, 1});
    const Framebuffer whole = ball().fast(camera, kWidth, kHeight, {});
    camera.clip.plane = {.point = {0, -1, -2}, .normal = {0, 0, -1}}; // without the half that is nearer
    const Framebuffer cut = ball().fast(camera, kWidth, kHeight, {});
    const std::size_t at = kHeight / 2 * kWidth + kWidth / 2;
    const double voxel = std::ldexp(2.0, -7);
    EXPECT_NEAR(static_cast<double>(cut.depth[at]) - static_cast<double>(whole.depth[at]), 2 * 0.9, 2 * voxel);
    EXPECT_NE(cut.colour[at], whole.colour[at]);
    const double to_plane = camera.position.z + 2;
    for (const float depth : cut.depth)
        EXPECT_GE(static_cast<double>(depth), to_plane - 2 * voxel);
}

// Far from the middle of wide-angle pictures a length at the same distance covers more pixels.
TEST(FastRenderer, HasNoHolesAtTheBordersOfWidePictures) {
    for (const double angle : {60.0, 90.0, 120.0, 150.0})
        for (const double turned : {0.6, 0.9})
            for (const double pixels : {0.8, 1.1, 1.42, 2.0}) {
                Camera camera;
                camera.view_angle = glm::radians(angle);
                const double off = turned * camera.view_angle / 2; // angle of the ball below the view direction
                const double focal = 700 / (2 * std::tan(camera.view_angle / 2));
                const double distance = std::max(1.2, std::ldexp(2.0, -7) * focal / pixels) / std::cos(off);
                camera.position = glm::dvec3(0, -1, -2) + distance * glm::dvec3(0, std::sin(off), std::cos(off));
                camera.focal_point = camera.position - glm::dvec3(0, 0, 1);
                const Difference d = difference(ball(), camera, 900, 700);
                const std::string what = std::to_string(angle) + " degrees, " + std::to_string(off) + ": " + text(d);
                EXPECT_GT(d.both, 100U) << what;
                EXPECT_EQ(d.open, 0U) << what;
                const double outline = pixels < 1 ? 10 : 0.003 * static_cast<double>(d.both);
                EXPECT_LE(static_cast<double>(d.lost), outline) << what;
            }
}

// Every attribute and kind of light. Splats are so large that both renderers show the same point in most pixels.
TEST(FastRenderer, ShadesAsTheReferenceDoes) {
    const auto point_light = Light{.kind = LightKind::point, .position = {2, 1, 1}};
    const auto spot_light =
        Light{.kind = LightKind::spot, .position = {1, 1, 2}, .direction = {-0.5F, -0.5F, -0.7071F}, .exponent = 5};
    for (const ColourFormat colour : {ColourFormat::none, ColourFormat::rgb565, ColourFormat::rgb888})
        for (const bool all : {false, true})
            for (const int lights : {0, 1, 2, 3}) { // 0: the model's own lights; else the kind of the first
                AttributeSet set = all ? every_attribute(colour, 6) : AttributeSet{.colour = colour};
                Model model = smooth_ball(6, set, all ? 3 : 1000000);
                for (std::size_t m = 0; m < model.parameters.materials.size(); ++m)
                    model.parameters.materials[m].colour = {static_cast<std::uint8_t>(80 * m + 60), 100, 200};
                std::vector<Light> &list = model.parameters.lights;
                if (lights > 0 && list.empty())
                    list.resize(1);
                if (lights == 2)
                    list[0] = point_light;
                if (lights == 3)
                    list[0] = spot_light;
                const DrawnModel drawn(std::move(model));
                for (const int level : {4, 5, 6})
                    for (const bool point_colours : {true, false}) {
                        const RenderOptions options{.point_colours = point_colours};
                        const Difference d =
                            difference(drawn, camera_at_ball(level, 8, kHeight), kWidth, kHeight, options, level);
                        const std::string what =
                            "colour " + std::to_string(static_cast<int>(colour)) + (all ? ", all attributes" : "") +
                            ", lights " + std::to_string(lights) + ", level " + std::to_string(level) + ": " + text(d);
                        EXPECT_GT(d.both, 10000U) << what;
                        EXPECT_LE(d.colour, 0.25) << what;
                        EXPECT_LE(static_cast<double>(d.other_colours), 0.02 * static_cast<double>(d.both)) << what;
                    }
            }
}

// Pictures of a file as the programs draw them: mixed levels, blocks and ellipses.
std::vector<Pixels> pictures(const Bytes &file, int threads) {
    StreamedModel model(value_of(Reader::open(file)));
    const FileHeader &header = model.reader().header();
    FastRenderer renderer(model.reader().parameters(), header.chunk_points, threads);
    std::vector<Pixels> all;
    bool mixed = false;
    struct Picture {
        double distance, angle, max_error;
        int width, height;
    };
    for (const Picture &it : {Picture{3, 0.7, 1.42, 301, 203}, Picture{1.2, 0.9, 12, 301, 203},
                              Picture{1.2, 0.9, 2.2, 57, 40}, Picture{1.5, 0.5, 1, 640, 480}}) {
        DetailView view{.camera = {}, .width = it.width, .height = it.height, .max_error = it.max_error};
        view.camera.focal_point = {0, -1, -2};
        view.camera.position = view.camera.focal_point + it.distance * glm::normalize(directions()[0]);
        view.camera.view_angle = it.angle;
        const Detail detail = value_of(model.load(view));
        for (const PointRun &run : detail.runs)
            mixed |= run.level != detail.runs[0].level;
        Framebuffer target(view.width, view.height);
        renderer.render(detail.runs, view.camera, {}, target);
        all.push_back(pixels_of(target));
    }
    EXPECT_TRUE(mixed || header.chunk_points > 512);
    return all;
}

TEST(FastRenderer, GivesTheSamePictureForAnyThreadsFilesAndSimdTargets) {
    const Model model = smooth_ball(7, every_attribute(ColourFormat::rgb565, 7), 5);
    std::vector<Bytes> files;
    for (const Storage storage : {Storage::packed, Storage::mapped})
        for (const std::uint32_t chunk_points : {512U, kDefaultChunkPoints})
            files.push_back(
                value_of(encode_model(model, {.storage = storage, .chunk_points = chunk_points, .threads = 1})));
    // Detail levels are chosen per chunk, so another chunk size may give another picture.
    for (const std::size_t chunks : {0U, 1U}) {
        const std::vector<Pixels> expected = pictures(files[chunks], 1);
        for (const int threads : {1, 2, 8})
            for (const std::size_t storage : {0U, 2U})
                EXPECT_EQ(pictures(files[chunks + storage], threads), expected) << threads << " threads";
        int tried = 0;
        for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1, ++tried) {
            hwy::SetSupportedTargetsForTest(targets & -targets);
            EXPECT_EQ(pictures(files[chunks], 2), expected) << hwy::TargetName(targets & -targets);
        }
        hwy::SetSupportedTargetsForTest(0);
        EXPECT_GE(tried, HWY_ARCH_X86 ? 2 : 1);
    }
}

// A level gives the same picture for any division into runs and, without surface offsets, into chunks. Surface offsets
// are estimated within a chunk.
TEST(FastRenderer, GivesTheSamePictureForAnyChunksAndRuns) {
    const Camera camera = camera_at_ball(7, 1.3, kHeight);
    const Framebuffer plain = plain_ball().fast(camera, kWidth, kHeight, {});
    for (const std::uint32_t chunk_points : {512U, kDefaultChunkPoints})
        EXPECT_EQ(pixels_of(make_ball(false, chunk_points).fast(camera, kWidth, kHeight, {})), pixels_of(plain));

    const DrawnModel big = make_ball(true, kDefaultChunkPoints);
    const Framebuffer expected = big.fast(camera, kWidth, kHeight, {});
    EXPECT_NE(pixels_of(expected), pixels_of(plain));
    const test::WholeLevel level(big.file, 7);
    std::vector<PointRun> pieces;
    for (const PointRun &run : level.runs) {
        std::uint32_t first = 0, node = 0;
        for (const std::uint8_t mask : run.chunk->masks) {
            const auto last = first + static_cast<std::uint32_t>(std::popcount(mask));
            if (++node % 7 == 0 || last == run.last) { // also cuts within bricks
                pieces.push_back(run);
                pieces.back().first = pieces.size() > 1 && pieces[pieces.size() - 2].chunk == run.chunk
                                          ? pieces[pieces.size() - 2].last
                                          : run.first;
                pieces.back().last = last;
            }
            first = last;
        }
    }
    EXPECT_GT(pieces.size(), 100U);
    Framebuffer target(kWidth, kHeight);
    FastRenderer renderer(big.model.parameters, big.chunk_points, 2);
    const RenderStatistics drawn = renderer.render(pieces, camera, {}, target);
    EXPECT_EQ(pixels_of(target), pixels_of(expected));
    EXPECT_EQ(drawn.points, big.model.levels[7].points.size());

    // The same renderer draws into a picture of another size, which is not empty.
    Framebuffer other(kWidth / 2, kHeight);
    other.clear({1, 2, 3, 4});
    renderer.render(level.runs, camera, {}, other);
    EXPECT_EQ(pixels_of(other), pixels_of(big.fast(camera, kWidth / 2, kHeight, {})));
}

TEST(FastRenderer, FillsTheBackgroundAndNeedsNoDepths) {
    const Camera camera = camera_at_ball(7, 1.0, kHeight);
    const Framebuffer expected = ball().fast(camera, kWidth, kHeight, {.background = {9, 8, 7, 0}});
    EXPECT_EQ(unpack_rgba(expected.colour[0]), (Rgba8{9, 8, 7, 0}));
    EXPECT_EQ(expected.depth[0], kEmpty);
    EXPECT_EQ(unpack_rgba(expected.colour[static_cast<std::size_t>(kHeight / 2 * kWidth + kWidth / 2)])[3], 255);

    Framebuffer target(kWidth, kHeight, false);
    std::fill(target.colour.begin(), target.colour.end(), 0xA5A5A5A5);
    const test::WholeLevel level(ball().file, 7);
    FastRenderer(ball().model.parameters, ball().chunk_points, 1)
        .render(level.runs, camera, {.background = {9, 8, 7, 0}}, target);
    EXPECT_EQ(target.colour.size(), target.pixels());
    EXPECT_TRUE(std::equal(target.colour.begin(), target.colour.end(), expected.colour.begin()));
    EXPECT_TRUE(target.depth.empty());

    Framebuffer nothing(kWidth, kHeight);
    const RenderStatistics drawn = FastRenderer(ball().model.parameters, ball().chunk_points, 1)
                                       .render({}, camera, {.background = {9, 8, 7, 0}}, nothing);
    EXPECT_EQ(drawn.drawn_points, 0U);
    EXPECT_EQ(nothing.depth[1000], kEmpty);
    EXPECT_EQ(unpack_rgba(nothing.colour[1000]), (Rgba8{9, 8, 7, 0}));
}

TEST(FastRenderer, RunsTasksWhenTheirRowsAreDone) {
    constexpr int kWide = 1280, kHigh = 480; // seven strips
    const Camera camera = camera_at_ball(7, 1.0, kHigh);
    const Framebuffer expected = ball().fast(camera, kWide, kHigh, {});
    const test::WholeLevel level(ball().file, 7);
    constexpr int kRows = 7; // of a task
    for (const int threads : {1, 2, 4}) {
        Framebuffer target(kWide, kHigh);
        std::vector<std::atomic<int>> runs(std::size_t{(kHigh + kRows - 1) / kRows});
        std::atomic<int> early = 0;
        const auto end_row = [&](std::size_t task) { return std::min((static_cast<int>(task) + 1) * kRows, kHigh); };
        FastRenderer(ball().model.parameters, ball().chunk_points, threads)
            .render(level.runs, camera, {}, target,
                    {.count = runs.size(), .end_row = end_row, .run = [&](std::size_t task, std::size_t thread) {
                         const auto end = static_cast<std::ptrdiff_t>(end_row(task)) * kWide;
                         early +=
                             std::equal(target.colour.begin(), target.colour.begin() + end, expected.colour.begin())
                                 ? 0
                                 : 1;
                         early += thread < static_cast<std::size_t>(threads) ? 0 : 1;
                         ++runs[task];
                     }});
        EXPECT_EQ(early, 0) << threads;
        EXPECT_TRUE(std::all_of(runs.begin(), runs.end(), [](const auto &count) { return count == 1; })) << threads;
        EXPECT_EQ(target.colour, expected.colour);
    }
}

} // namespace
} // namespace pbm
