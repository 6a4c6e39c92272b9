// Exposure, tone curve and the background behind them.
#include "viewer/finish/finish.h"
#include "viewer/finish/scale_bar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace pbm {
namespace {

double linear_of(int byte) {
    const double s = byte / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}
double byte_of(double light) {
    light = std::min(light, 1.0);
    return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055);
}

// A row of all greys.
Framebuffer greys() {
    Framebuffer picture(256, 1, false);
    for (int byte = 0; byte < 256; ++byte) {
        const auto grey = static_cast<std::uint8_t>(byte);
        picture.colour[static_cast<std::size_t>(byte)] = pack_rgba({grey, grey, grey, 255});
    }
    return picture;
}

TEST(Finish, ExposureMultipliesLight) {
    for (const double stops : {-3.0, -0.5, 0.5, 2.0}) {
        Framebuffer picture = greys();
        grade({.exposure = stops}, picture);
        for (int byte = 0; byte < 256; ++byte)
            EXPECT_NEAR(unpack_rgba(picture.colour[static_cast<std::size_t>(byte)])[1],
                        byte_of(linear_of(byte) * std::exp2(stops)), 1)
                << byte << " by " << stops;
    }
}

TEST(Finish, FilmKeepsWhiteAndCutsNothingOff) {
    for (const double stops : {-1.0, 0.0, 1.0, 3.0}) {
        Framebuffer picture = greys();
        grade({.exposure = stops, .tone = Tone::filmic}, picture);
        int cut = 0;
        for (std::size_t byte = 1; byte < 256; ++byte) {
            EXPECT_GE(picture.colour[byte], picture.colour[byte - 1]);
            cut += (picture.colour[byte] & 255) == 255;
        }
        EXPECT_EQ(picture.colour[0], 0xFF000000U);
        EXPECT_EQ((picture.colour[255] & 255) == 255, stops >= 0);
        EXPECT_LE(cut, stops >= 3 ? 12 : 3);
    }
}

// Light above white is there, though a picture of 8 bits does not show it.
TEST(Finish, LightOfSamplesIsNotCutOffBeforeTheExposure) {
    Framebuffer picture(2, 1, false);
    picture.colour[0] = 0xFFFFFFFFU;
    picture.colour[1] = 0x80FFFFFFU;
    const std::vector<Float4> light{Float4{1.6F, 0.8F, 0, 1}, Float4{0.8F, 0.4F, 0, 0.5F}};
    grade({.exposure = -1}, light, picture);
    for (const std::uint32_t pixel : picture.colour) {
        EXPECT_NEAR(pixel & 255, byte_of(0.8), 1);
        EXPECT_NEAR(pixel >> 8 & 255, byte_of(0.4), 1);
        EXPECT_EQ(pixel >> 16 & 255, 0U);
    }
    EXPECT_EQ(picture.colour[1] >> 24, 0x80U);
}

TEST(Finish, BackgroundKeepsItsColours) {
    const RenderOptions options{.background = {200, 10, 90, 255}, .background_below = Rgba8{0, 0, 0, 255}};
    EXPECT_EQ(before_finish({}, options), options);
    const RenderOptions drawn = before_finish({.exposure = 1}, options);
    EXPECT_EQ(drawn.background[3], 0);
    EXPECT_FALSE(drawn.background_below);
    Framebuffer picture(1, 3, false);
    picture.colour[0] = 0;
    picture.colour[1] = 0xFF123456U;
    picture.colour[2] = 0x80FFFFFFU;
    add_background({}, options, picture);
    EXPECT_EQ(unpack_rgba(picture.colour[0]), background_at(options, 0.5 / 3));
    EXPECT_EQ(picture.colour[1], 0xFF123456U);
    const Rgba8 behind = background_at(options, 2.5 / 3), half = unpack_rgba(picture.colour[2]);
    EXPECT_EQ(half[3], 255);
    EXPECT_NEAR(half[0], byte_of(0.502 + 0.498 * linear_of(behind[0])), 1);
    Framebuffer nothing(1, 1, false);
    nothing.colour[0] = 0x40000010U;
    add_background({}, {.background = {0, 0, 0, 0}}, nothing);
    EXPECT_EQ(nothing.colour[0], 0x40000010U);
}

// A square in the middle of a picture without and with background.
TEST(Finish, ShadowFallsToTheLowerRightAndHasSoftEdges) {
    const Finish finish{.drop_shadow = true};
    EXPECT_FALSE(finish.is_none());
    for (const Rgba8 behind : {Rgba8{255, 255, 255, 255}, Rgba8{0, 0, 0, 0}}) {
        Framebuffer picture(200, 200, false);
        picture.colour.assign(picture.pixels(), 0);
        for (std::size_t y = 60; y < 140; ++y)
            for (std::size_t x = 60; x < 140; ++x)
                picture.colour[y * 200 + x] = 0xFF0000FFU;
        add_background(finish, {.background = behind}, picture);
        const auto shade = [&](std::size_t x, std::size_t y) {
            const Rgba8 pixel = unpack_rgba(picture.colour[y * 200 + x]);
            return behind[3] == 0 ? pixel[3] : 255 - pixel[0];
        };
        EXPECT_EQ(picture.colour[100 * 200 + 100], 0xFF0000FFU);
        EXPECT_EQ(shade(10, 10), 0);
        EXPECT_GT(shade(141, 141), shade(58, 58) + 10);
        for (std::size_t i = 141; i < 155; ++i)
            EXPECT_LE(shade(i + 1, 100), shade(i, 100));
        EXPECT_EQ(shade(160, 100), 0);
    }
}

TEST(ScaleBar, TakesTheUnitThatItsLengthNeeds) {
    EXPECT_EQ(scale_bar(0.001, 120, Unit::metre).text, "10 cm");
    EXPECT_EQ(scale_bar(0.00001, 600, Unit::metre).text, "5 mm");
    EXPECT_EQ(scale_bar(0.01, 120, Unit::metre).text, "1 m");
    Framebuffer picture(300, 100, false);
    picture.clear({255, 255, 255, 255});
    add_scale_bar({.scale_bar = true}, 0.01, Unit::metre, picture);
    EXPECT_EQ(std::count(picture.colour.begin() + 300 * 84, picture.colour.begin() + 300 * 85, 0xFF000000U), 50);
    Framebuffer dark(300, 100, false);
    dark.clear({0, 0, 0, 255});
    add_scale_bar({}, 0.01, Unit::metre, dark);
    EXPECT_EQ(std::count(dark.colour.begin(), dark.colour.end(), 0xFF000000U), 30000);
    add_scale_bar({.scale_bar = true}, 0.01, Unit::metre, dark);
    EXPECT_EQ(std::count(dark.colour.begin() + 300 * 84, dark.colour.begin() + 300 * 85, 0xFFFFFFFFU), 50);
}

} // namespace
} // namespace pbm
