// Pictures through the C API.
#include "ball.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace pbm::test {
namespace {

constexpr int kWidth = 48, kHeight = 32;

int drawn_pixels(const Picture &picture) {
    return static_cast<int>(
        std::count_if(picture.depths.begin(), picture.depths.end(), [](float depth) { return std::isfinite(depth); }));
}

TEST(CApiPicture, ShowsTheBallInEveryQuality) {
    const BallModel ball;
    const pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    for (const int quality : {PBM_FAST, PBM_FINE})
        for (const int cue : {PBM_NO_CUE, PBM_EYE_DOME, PBM_AMBIENT_OCCLUSION}) {
            Picture picture(kWidth, kHeight);
            pbm_render_options options = PBM_NEW(pbm_render_options);
            options.quality = quality;
            options.depth_cue = cue;
            options.samples = 2;
            options.flags = PBM_BACKGROUND;
            options.background[2] = 7;
            pbm_error error;
            ASSERT_EQ(pbm_render(ball.get(), &camera, &options, &picture.api, &error), PBM_OK) << error.message;
            const double expected = 3.14159 / 4 * kHeight * kHeight * 0.95 * 0.95; // pixels of the disc
            EXPECT_NEAR(drawn_pixels(picture), expected, 0.1 * expected);
            EXPECT_EQ(picture.pixels[2], 7); // a corner
            EXPECT_EQ(picture.pixels[3], 0);
            const std::size_t middle = kHeight / 2 * kWidth + kWidth / 2;
            EXPECT_GT(picture.pixels[4 * middle], 30);
            EXPECT_EQ(picture.pixels[4 * middle + 3], 255);
            const double eye = std::hypot(camera.position[0] - 10, camera.position[1] - 20, camera.position[2] - 30);
            EXPECT_NEAR(picture.depths[middle], eye - 1, 0.1);
        }
}

TEST(CApiPicture, KeepsWhatLiesBetweenTheRows) {
    const BallModel ball;
    const pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    Picture tight(kWidth, kHeight);
    pbm_error error;
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &tight.api, &error), PBM_OK) << error.message;
    constexpr std::size_t kStride = 4 * kWidth + 12, kDepthStride = kWidth + 3;
    std::vector<std::uint8_t> pixels(kStride * (kHeight - 1) + 4 * kWidth, 99);
    std::vector<float> depths(kDepthStride * (kHeight - 1) + kWidth, -1.0F);
    pbm_picture wide = PBM_NEW(pbm_picture);
    wide.width = kWidth;
    wide.height = kHeight;
    wide.pixels = pixels.data();
    wide.pixel_bytes = pixels.size();
    wide.stride = kStride;
    wide.depths = depths.data();
    wide.depth_count = depths.size();
    wide.depth_stride = kDepthStride;
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &wide, &error), PBM_OK) << error.message;
    for (std::size_t y = 0; y < kHeight; ++y) {
        EXPECT_TRUE(std::equal(&tight.pixels[4 * kWidth * y], &tight.pixels[4 * kWidth * y] + 4 * kWidth,
                               &pixels[kStride * y]));
        EXPECT_TRUE(
            std::equal(&tight.depths[kWidth * y], &tight.depths[kWidth * y] + kWidth, &depths[kDepthStride * y]));
        if (y + 1 < kHeight) {
            EXPECT_EQ(pixels[kStride * y + 4 * kWidth], 99);
            EXPECT_EQ(depths[kDepthStride * y + kWidth], -1.0F);
        }
    }
    --wide.pixel_bytes;
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &wide, &error), PBM_USAGE);
    ++wide.pixel_bytes;
    --wide.depth_count;
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &wide, &error), PBM_USAGE);
    ++wide.depth_count;
    wide.stride = 4 * kWidth - 1;
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &wide, &error), PBM_USAGE);
    wide.stride = std::numeric_limits<std::size_t>::max();
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &wide, &error), PBM_USAGE);
}

TEST(CApiPicture, IsClippedAndOrthographic) {
    const BallModel ball;
    pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    pbm_error error;
    Picture whole(kWidth, kHeight), half(kWidth, kHeight), flat(kWidth, kHeight);
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &whole.api, &error), PBM_OK) << error.message;
    camera.orthographic = 1;
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &flat.api, &error), PBM_OK) << error.message;
    const std::size_t middle = kHeight / 2 * kWidth + kWidth / 2;
    EXPECT_NEAR(flat.depths[middle], whole.depths[middle], 0.1); // from where the caller placed it
    camera.orthographic = 0;
    camera.clip = PBM_CLIP_PLANE;
    camera.plane_point[0] = 10;
    camera.plane_normal[0] = 1;
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &half.api, &error), PBM_OK) << error.message;
    EXPECT_NEAR(drawn_pixels(half), drawn_pixels(whole) / 2.0, drawn_pixels(whole) / 8.0);
    camera.clip = PBM_CLIP_BOX; // an empty one
    Picture none(kWidth, kHeight);
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &none.api, &error), PBM_OK) << error.message;
    EXPECT_EQ(drawn_pixels(none), 0);
    camera.clip = 4;
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &none.api, &error), PBM_USAGE);
}

TEST(CApiPicture, RefusesCamerasThatSeeNothing) {
    const BallModel ball;
    const pbm_camera good = camera_of(ball.get(), kWidth, kHeight);
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                     kInfinity = std::numeric_limits<double>::infinity();
    Picture picture(kWidth, kHeight);
    pbm_error error;
    const auto refuses = [&](auto &&spoil) {
        pbm_camera camera = good;
        spoil(camera);
        return pbm_render(ball.get(), &camera, nullptr, &picture.api, &error) == PBM_USAGE;
    };
    for (const double bad : {kNan, kInfinity, -kInfinity})
        for (std::size_t axis = 0; axis < 3; ++axis) {
            EXPECT_TRUE(refuses([&](pbm_camera &c) { c.position[axis] = bad; }));
            EXPECT_TRUE(refuses([&](pbm_camera &c) { c.focal_point[axis] = bad; }));
            EXPECT_TRUE(refuses([&](pbm_camera &c) { c.up[axis] = bad; }));
            EXPECT_TRUE(refuses([&](pbm_camera &c) { c.clip = PBM_CLIP_PLANE, c.plane_normal[axis] = bad; }));
            EXPECT_TRUE(refuses(
                [&](pbm_camera &c) { c.clip = PBM_CLIP_PLANE, c.plane_normal[0] = 1, c.plane_point[axis] = bad; }));
            EXPECT_TRUE(refuses([&](pbm_camera &c) { c.clip = PBM_CLIP_BOX, c.box_lowest[axis] = bad; }));
            EXPECT_TRUE(refuses([&](pbm_camera &c) { c.clip = PBM_CLIP_BOX, c.box_highest[axis] = bad; }));
        }
    for (const double angle : {kNan, kInfinity, -1.0, 3.2})
        EXPECT_TRUE(refuses([&](pbm_camera &c) { c.view_angle = angle; }));
    EXPECT_TRUE(refuses([&](pbm_camera &c) { std::copy_n(c.position, 3, c.focal_point); }));
    EXPECT_TRUE(refuses([&](pbm_camera &c) { c.clip = PBM_CLIP_PLANE; })); // a normal of zero
    EXPECT_TRUE(refuses([&](pbm_camera &c) { c.struct_size = 0; }));
    EXPECT_FALSE(refuses([&](pbm_camera &c) { c.view_angle = 0; })); // the default one
    EXPECT_EQ(pbm_render(ball.get(), nullptr, nullptr, &picture.api, &error), PBM_USAGE);
    EXPECT_EQ(pbm_render(ball.get(), &good, nullptr, nullptr, &error), PBM_USAGE);
    EXPECT_EQ(pbm_render(nullptr, &good, nullptr, &picture.api, &error), PBM_USAGE);
}

TEST(CApiPicture, ShowsTheRestOfADamagedModel) {
    std::vector<std::uint8_t> bytes = ball_bytes({{"depth", "7"}});
    pbm_model *whole = nullptr, *damaged = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_memory(bytes.data(), bytes.size(), &whole, &error), PBM_OK) << error.message;
    const pbm_camera camera = camera_of(whole, 300, 300);
    Picture expected(300, 300), drawn(300, 300);
    ASSERT_EQ(pbm_render(whole, &camera, nullptr, &expected.api, &error), PBM_OK) << error.message;
    pbm_close(whole);
    for (const double part : {0.15, 0.18, 0.21, 0.24, 0.27}) // in chunks of the finest level; fields lie behind them
        bytes[static_cast<std::size_t>(part * static_cast<double>(bytes.size()))] ^= 1U;
    ASSERT_EQ(pbm_open_memory(bytes.data(), bytes.size(), &damaged, &error), PBM_OK) << error.message;
    pbm_render_options options = PBM_NEW(pbm_render_options);
    options.finest_level = 6;
    EXPECT_EQ(pbm_render(damaged, &camera, &options, &drawn.api, &error), PBM_OK) << error.message;
    for (int again = 0; again < 2; ++again) {
        std::fill(drawn.pixels.begin(), drawn.pixels.end(), std::uint8_t{0});
        EXPECT_EQ(pbm_render(damaged, &camera, nullptr, &drawn.api, &error), PBM_INVALID);
        EXPECT_NE(error.offset, PBM_NO_OFFSET);
        EXPECT_STRNE(error.name, "");
        EXPECT_NEAR(drawn_pixels(drawn), drawn_pixels(expected), 0.1 * drawn_pixels(expected));
        EXPECT_NE(drawn.pixels, expected.pixels); // a coarser level in one place
    }
    pbm_close(damaged);
}

TEST(CApiPicture, GoesOnWithTheSamplesOfTheLastOne) {
    const BallModel ball(Options{{"depth", "6"}, {"ground", "wood"}, {"ground-resolution", "64"}});
    const pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    pbm_error error;
    pbm_render_options options = PBM_NEW(pbm_render_options);
    options.quality = PBM_FINE;
    const auto draw = [&](int samples, Picture &to) {
        options.samples = samples;
        EXPECT_EQ(pbm_render(ball.get(), &camera, &options, &to.api, &error), PBM_OK) << error.message;
    };
    Picture at_once(kWidth, kHeight), fewer(kWidth, kHeight), in_steps(kWidth, kHeight), again(kWidth, kHeight);
    draw(5, at_once);
    draw(2, fewer); // begins anew
    draw(3, in_steps);
    EXPECT_NE(in_steps.pixels, fewer.pixels);
    draw(5, in_steps);
    EXPECT_EQ(in_steps.pixels, at_once.pixels);
    EXPECT_EQ(in_steps.depths, at_once.depths);
    options.flags = PBM_NO_GROUND; // another picture
    draw(5, in_steps);
    EXPECT_NE(in_steps.pixels, at_once.pixels);
    options.flags = 0;
    options.depth_cue = PBM_EYE_DOME;
    draw(3, again);
    draw(5, again);
    draw(5, in_steps);
    EXPECT_EQ(in_steps.pixels, again.pixels);
    EXPECT_NE(in_steps.pixels, at_once.pixels);
}

// The ball has no lights of its own: only those that stay with the model leave its other side dark.
TEST(CApiPicture, LightsFollowTheEyeOrTheModel) {
    const BallModel ball;
    pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    for (int axis = 0; axis < 3; ++axis)
        camera.position[axis] = 2 * camera.focal_point[axis] - camera.position[axis];
    for (const int quality : {PBM_FAST, PBM_FINE}) {
        pbm_render_options options = PBM_NEW(pbm_render_options);
        options.quality = quality;
        options.samples = 2;
        options.flags = PBM_BACKGROUND; // black
        const auto light = [&](int follows) {
            options.light_follows = follows;
            Picture picture(kWidth, kHeight);
            pbm_error error;
            EXPECT_EQ(pbm_render(ball.get(), &camera, &options, &picture.api, &error), PBM_OK) << error.message;
            std::int64_t sum = 0;
            for (std::size_t i = 0; i < picture.pixels.size(); ++i)
                sum += picture.pixels[i];
            return sum;
        };
        const std::int64_t usual = light(PBM_LIGHTS_DEFAULT), fixed = light(PBM_LIGHTS_MODEL);
        EXPECT_LT(fixed, usual * 9 / 10);
        EXPECT_EQ(light(PBM_LIGHTS_EYE), usual);
    }
}

TEST(CApiPicture, AHeadlightShinesFromItsSideOfTheEye) {
    const BallModel ball;
    const pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    for (const int quality : {PBM_FAST, PBM_FINE})
        for (const double side : {-1.0, 1.0}) {
            pbm_render_options options = PBM_NEW(pbm_render_options);
            options.quality = quality;
            options.samples = 2;
            options.flags = static_cast<std::uint32_t>(PBM_BACKGROUND) | PBM_HEADLIGHT; // black
            options.headlight[0] = 1.2 * side;
            Picture picture(kWidth, kHeight);
            pbm_error error;
            ASSERT_EQ(pbm_render(ball.get(), &camera, &options, &picture.api, &error), PBM_OK) << error.message;
            std::array<std::int64_t, 2> sums{}; // left and right half
            for (std::size_t i = 0; i < picture.pixels.size(); i += 4)
                sums[i / 4 % kWidth < kWidth / 2 ? 0 : 1] += picture.pixels[i];
            EXPECT_GT(sums[side > 0 ? 1 : 0], sums[side > 0 ? 0 : 1] * 7 / 5);
        }
}

TEST(CApiPicture, AnUncolouredCloudIsShownByHeight) {
    const Ball ball;
    pbm_arrays arrays = PBM_NEW(pbm_arrays);
    arrays.vertex_count = ball.positions.size();
    arrays.positions = ball.positions.front().data();
    pbm_model *cloud = nullptr;
    pbm_error error;
    ASSERT_EQ(build_ball({{"depth", "6"}}, nullptr, &cloud, &error, &arrays), PBM_OK) << error.message;
    const pbm_camera camera = camera_of(cloud, kWidth, kHeight);
    const auto draw = [&](const char *colour_by, int cue) {
        pbm_render_options options = PBM_NEW(pbm_render_options);
        options.colour_by = colour_by;
        options.depth_cue = cue;
        Picture picture(kWidth, kHeight);
        EXPECT_EQ(pbm_render(cloud, &camera, &options, &picture.api, &error), PBM_OK) << error.message;
        return picture.pixels;
    };
    const std::vector<std::uint8_t> unasked = draw(nullptr, PBM_NO_CUE);
    EXPECT_EQ(unasked, draw("height", PBM_EYE_DOME));
    EXPECT_NE(unasked, draw(nullptr, PBM_CUE_OFF));
    EXPECT_NE(unasked, draw("normal", PBM_NO_CUE));
    const std::vector<std::uint8_t> plain = draw("plain", PBM_CUE_OFF);
    EXPECT_TRUE(std::all_of(plain.begin(), plain.end(), [&](const std::uint8_t &byte) {
        const auto i = static_cast<std::size_t>(&byte - plain.data());
        return i % 4 == 3 || byte == plain[i / 4 * 4];
    })) << "its material is grey";
    pbm_close(cloud);
}

// The field of the ball is its height.
TEST(CApiPicture, PointsHaveTheColoursOfAField) {
    const BallModel ball;
    const pbm_camera camera = camera_of(ball.get(), 640, 480);
    pbm_error error;
    pbm_render_options options = PBM_NEW(pbm_render_options);
    const auto draw = [&] {
        Picture picture(640, 480);
        EXPECT_EQ(pbm_render(ball.get(), &camera, &options, &picture.api, &error), PBM_OK) << error.message;
        return picture.pixels;
    };
    const std::vector<std::uint8_t> own = draw();
    options.colour_by = "Height"; // in any case
    const std::vector<std::uint8_t> with_legend = draw();
    options.flags = PBM_NO_LEGEND;
    const std::vector<std::uint8_t> viridis = draw();
    const auto pixel = [](const std::vector<std::uint8_t> &pixels, std::size_t x, std::size_t y) {
        return std::array<int, 3>{pixels[4 * (640 * y + x)], pixels[4 * (640 * y + x) + 1],
                                  pixels[4 * (640 * y + x) + 2]};
    };
    const std::array<int, 3> top = pixel(viridis, 320, 60), bottom = pixel(viridis, 320, 420);
    EXPECT_GT(top[1], 2 * top[2]);           // yellow
    EXPECT_GT(bottom[2], bottom[1] * 3 / 2); // violet
    EXPECT_EQ(pixel(viridis, 10, 10), pixel(own, 10, 10));
    EXPECT_NE(pixel(with_legend, 620, 20), pixel(viridis, 620, 20));
    EXPECT_EQ(pixel(with_legend, 320, 420), bottom);
    options.colour_map = PBM_MAP_GREY;
    options.colour_range[0] = 0.9;
    options.colour_range[1] = 1;
    const std::array<int, 3> dark = pixel(draw(), 320, 420);
    EXPECT_EQ(dark, (std::array<int, 3>{dark[0], dark[0], dark[0]}));
    EXPECT_LT(dark[0], 20); // below the range
    options = PBM_NEW(pbm_render_options);
    options.struct_size = offsetof(pbm_render_options, colour_range); // of a program that does not know of fields
    options.colour_by = "nothing";
    EXPECT_EQ(draw(), own);
}

TEST(CApiPicture, IsCoarserWhereMemoryIsLimited) {
    const std::vector<std::uint8_t> bytes = ball_bytes({{"depth", "7"}});
    pbm_model *model = nullptr;
    pbm_error error;
    ASSERT_EQ(pbm_open_memory(bytes.data(), bytes.size(), &model, &error), PBM_OK) << error.message;
    const pbm_camera camera = camera_of(model, 300, 300);
    Picture exact(300, 300), limited(300, 300), coarse(300, 300);
    ASSERT_EQ(pbm_render(model, &camera, nullptr, &exact.api, &error), PBM_OK) << error.message;
    pbm_render_options options = PBM_NEW(pbm_render_options);
    options.max_memory = std::uint64_t{400} << 10;
    EXPECT_EQ(pbm_render(model, &camera, &options, &limited.api, &error), PBM_LIMIT);
    EXPECT_STREQ(error.name, "");
    EXPECT_NEAR(drawn_pixels(limited), drawn_pixels(exact), 0.2 * drawn_pixels(exact));
    EXPECT_NE(limited.pixels, exact.pixels);
    options.max_error = 20; // a picture that needs less
    EXPECT_EQ(pbm_render(model, &camera, &options, &coarse.api, &error), PBM_OK) << error.message;
    options.max_memory = std::uint64_t{64} << 20;
    options.max_error = 0;
    EXPECT_EQ(pbm_render(model, &camera, &options, &limited.api, &error), PBM_OK) << error.message;
    EXPECT_EQ(limited.pixels, exact.pixels);
    pbm_close(model);
}

TEST(CApiPicture, RefusesSizesAndOptionsThatAreNone) {
    const BallModel ball;
    const pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    pbm_camera other = PBM_NEW(pbm_camera);
    Picture picture(kWidth, kHeight);
    pbm_error error;
    for (const int size : {0, -1, 32769, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
        EXPECT_EQ(pbm_default_camera(ball.get(), size, 10, &other, &error), PBM_USAGE);
        EXPECT_EQ(pbm_default_camera(ball.get(), 10, size, &other, &error), PBM_USAGE);
        pbm_picture bad = picture.api;
        bad.width = size;
        EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &bad, &error), PBM_USAGE);
        bad.width = kWidth;
        bad.height = size;
        EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &bad, &error), PBM_USAGE);
    }
    EXPECT_EQ(pbm_default_camera(ball.get(), 10, 10, nullptr, &error), PBM_USAGE);
    pbm_picture nowhere = picture.api;
    nowhere.pixels = nullptr;
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &nowhere, &error), PBM_OK); // depths alone
    nowhere.depths = nullptr;
    EXPECT_EQ(pbm_render(ball.get(), &camera, nullptr, &nowhere, &error), PBM_USAGE);
    const auto refuses = [&](auto &&spoil) {
        pbm_render_options options = PBM_NEW(pbm_render_options);
        spoil(options);
        return pbm_render(ball.get(), &camera, &options, &picture.api, &error) == PBM_USAGE;
    };
    EXPECT_FALSE(refuses([](pbm_render_options &) {}));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.quality = 2; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.samples = 257; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.samples = -1; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.depth_cue = 4; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.light_follows = 3; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.flags = 1024; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.finest_level = 17; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.max_error = -1; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.max_error = std::numeric_limits<double>::quiet_NaN(); }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.threads = 2000; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.struct_size = 3; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.flags = PBM_HEADLIGHT, o.headlight[0] = 3.2; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.flags = PBM_HEADLIGHT, o.headlight[1] = -1.6; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) {
        o.flags = PBM_HEADLIGHT;
        o.headlight[1] = std::numeric_limits<double>::quiet_NaN();
    }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.colour_by = "width"; }));
    EXPECT_STREQ(error.message, "the model has no field 'width' but height");
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.colour_by = "height", o.colour_map = 4; }));
    EXPECT_TRUE(refuses([](pbm_render_options &o) { o.colour_by = "height", o.colour_range[0] = 1; }));
    EXPECT_TRUE(refuses(
        [](pbm_render_options &o) { o.colour_by = "height", o.colour_map = PBM_MAP_CLASSES, o.colour_range[1] = 1; }));
    EXPECT_FALSE(refuses([](pbm_render_options &o) { o.colour_by = ""; }));
}

TEST(CApiPicture, LeavesOutWhatTheOptionsSay) {
    const BallModel ball(Options{{"depth", "6"},
                                 {"texture", "marble"},
                                 {"lights", "studio"},
                                 {"shadows", nullptr},
                                 {"ground", nullptr},
                                 {"ground-resolution", "64"}});
    const pbm_camera camera = camera_of(ball.get(), kWidth, kHeight);
    pbm_error error;
    Picture all(kWidth, kHeight);
    ASSERT_EQ(pbm_render(ball.get(), &camera, nullptr, &all.api, &error), PBM_OK) << error.message;
    for (const int flag : {PBM_NO_TEXTURE, PBM_NO_SHADOWS, PBM_NO_GROUND}) {
        Picture less(kWidth, kHeight);
        pbm_render_options options = PBM_NEW(pbm_render_options);
        options.flags = static_cast<std::uint32_t>(flag);
        ASSERT_EQ(pbm_render(ball.get(), &camera, &options, &less.api, &error), PBM_OK) << error.message;
        EXPECT_NE(all.pixels, less.pixels) << flag;
    }
}

} // namespace
} // namespace pbm::test
