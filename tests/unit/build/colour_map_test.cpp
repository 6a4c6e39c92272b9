#include "pbm_build/texture/colour_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace pbm::build {
namespace {

std::array<Rgb8, 256> palette_of(TextureKind kind, std::string_view text) {
    const auto stops = find_colour_stops(kind, text);
    EXPECT_TRUE(stops.ok()) << text;
    return make_palette(*stops);
}

std::string error_of(std::string_view text) {
    const auto stops = find_colour_stops(TextureKind::marble, text);
    EXPECT_FALSE(stops.ok()) << text;
    if (stops.ok())
        return {};
    EXPECT_EQ(stops.error().code, ErrorCode::usage);
    return stops.error().message;
}

TEST(ColourMap, NamedOnesAreSmoothAndKeepTheirDirection) {
    for (const TextureKind kind : {TextureKind::marble, TextureKind::wood}) {
        EXPECT_GE(colour_map_names(kind).size(), 3U);
        for (const std::string_view name : colour_map_names(kind)) {
            const auto palette = palette_of(kind, name);
            for (std::size_t channel = 0; channel < 3; ++channel) {
                const bool rises = palette[255][channel] > palette[0][channel];
                for (std::size_t i = 1; i < 256; ++i) {
                    const int step = (palette[i][channel] - palette[i - 1][channel]) * (rises ? 1 : -1);
                    EXPECT_GE(step, 0) << name << ' ' << i;
                    EXPECT_LE(step, 6) << name << ' ' << i;
                }
            }
        }
    }
}

TEST(ColourMap, TheFirstNameIsTheDefault) {
    for (const TextureKind kind : {TextureKind::marble, TextureKind::wood})
        EXPECT_EQ(palette_of(kind, ""), palette_of(kind, colour_map_names(kind).front()));
}

TEST(ColourMap, StopsAreMixedInLinearLight) {
    const auto palette = palette_of(TextureKind::wood, "0:#000000,1:#FFffFF");
    EXPECT_EQ(palette[0], (Rgb8{0, 0, 0}));
    EXPECT_EQ(palette[255], (Rgb8{255, 255, 255}));
    EXPECT_EQ(palette[51], (Rgb8{124, 124, 124})); // a fifth of white in linear light
    const auto between = palette_of(TextureKind::wood, "0.4:#102030,0.6:#405060");
    EXPECT_EQ(between[102], (Rgb8{0x10, 0x20, 0x30}));
    EXPECT_EQ(between[0], between[102]);
    EXPECT_EQ(between[153], between[255]);
    EXPECT_EQ(palette_of(TextureKind::marble, "0.5:#123456")[7], (Rgb8{0x12, 0x34, 0x56}));
}

TEST(ColourMap, RefusesBadColourMapsWithAReason) {
    EXPECT_NE(error_of("oak").find("'oak': there are white, carrara"), std::string::npos);
    EXPECT_NE(error_of("0:#12345").find("position:#rrggbb"), std::string::npos);
    for (const char *const bad :
         {"0:#1234567", ":#123456", "0:123456", "0:#12345g", "0:#-12345", "nan:#000000", "-0.1:#000000", "1.1:#000000",
          "0:#000000,", ",0:#000000", "0 :#000000", "0;#000000", "inf:#000000", "0x0:#000000", ","})
        EXPECT_NE(error_of(bad).find("is no colour stop"), std::string::npos) << bad;
    EXPECT_NE(error_of("0.5:#000000,0.5:#ffffff").find("not behind"), std::string::npos);
    std::string many = "0:#000000";
    for (int i = 1; i <= 64; ++i)
        many.append(1, ',').append(std::to_string(i / 64.0)).append(":#000000");
    EXPECT_NE(error_of(many).find("more than 64"), std::string::npos);
}

} // namespace
} // namespace pbm::build
