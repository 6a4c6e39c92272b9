// The legend of a field.
#include "pbm_render/appearance/legend.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

const Field kIntensity{.name = "intensity", .unit = "dB", .offset = 0, .scale = 1, .bytes = 1};

TEST(Legend, SaysNameUnitAndRange) {
    const Legend legend = *legend_of(field_colours(0, kIntensity, {.range = {{0, 5}}, .map = {}}, {}));
    EXPECT_EQ(legend.title, "intensity (dB)");
    EXPECT_EQ(legend.ticks, (std::array<std::string, 3>{"0", "2.5", "5"}));
    EXPECT_TRUE(legend.rows.empty());
}

TEST(Legend, TellsItsTicksApart) {
    const Field time{.name = "gps_time", .unit = "s", .offset = 388000000, .scale = 0.001, .bytes = 2};
    const Legend legend = *legend_of(field_colours(0, time, {.range = {{388000000, 388000001}}, .map = {}}, {}));
    EXPECT_EQ(legend.ticks, (std::array<std::string, 3>{"388000000", "388000000.5", "388000001"}));
    const Field height{.name = "height", .unit = "m", .offset = 1234.5678, .scale = 0.001, .bytes = 2};
    const auto ticks = [&](double least, double most) {
        return legend_of(field_colours(0, height, {.range = {{least, most}}, .map = {}}, {}))->ticks;
    };
    EXPECT_EQ(ticks(1234.5678, 1260.9876), (std::array<std::string, 3>{"1234.6", "1247.8", "1261"}));
    EXPECT_EQ(ticks(4182345.678, 4182845.321), (std::array<std::string, 3>{"4182346", "4182595", "4182845"}));
    EXPECT_EQ(ticks(-0.012345, 0.0456789), (std::array<std::string, 3>{"-0.0123", "0.0167", "0.0457"}));
    EXPECT_EQ(ticks(-2.08011e9, 2.07954e9), (std::array<std::string, 3>{"-2.08e+09", "0", "2.08e+09"}));
    EXPECT_EQ(ticks(-2, 1999.6), (std::array<std::string, 3>{"0", "1000", "2000"}));
    const Legend constant = *legend_of(field_colours(0, kIntensity, {}, Bytes(9, 8)));
    EXPECT_EQ(constant.ticks, (std::array<std::string, 3>{"", "7", ""}));
}

TEST(Legend, NamesTheClassesOfLas) {
    const Field classes{.name = "classification", .unit = "", .average = FieldAverage::majority};
    const Legend legend = *legend_of(field_colours(0, classes, {}, Bytes{3, 7, 200}));
    ASSERT_EQ(legend.rows.size(), 3U);
    EXPECT_EQ(legend.rows[0].text, "2 ground");
    EXPECT_EQ(legend.rows[1].text, "6 building");
    EXPECT_EQ(legend.rows[2].text, "199");
    const Field below{.name = "classification", .unit = "", .offset = -1, .average = FieldAverage::majority};
    EXPECT_EQ(legend_of(field_colours(0, below, {}, Bytes{1}))->rows[0].text, "-1");
}

TEST(Legend, IsDrawnInTheCornerAndLeftOutOfSmallPictures) {
    const Legend legend = *legend_of(field_colours(0, kIntensity, {}, {}));
    const auto changed = [&](int width, int height) {
        Framebuffer picture(width, height);
        picture.clear({200, 200, 200, 255});
        const PixelArray<std::uint32_t> before = picture.colour;
        draw_legend(legend, picture);
        std::size_t pixels = 0, left = 0;
        for (std::size_t i = 0; i < before.size(); ++i)
            if (picture.colour[i] != before[i]) {
                ++pixels;
                left += i % static_cast<std::size_t>(width) < static_cast<std::size_t>(width) / 2 ? 1 : 0;
            }
        EXPECT_EQ(left, 0U);
        return pixels;
    };
    EXPECT_GT(changed(640, 480), 5000U);
    EXPECT_GT(changed(3840, 2160), 80000U);
    EXPECT_EQ(changed(120, 120), 0U);
}

} // namespace
} // namespace pbm
