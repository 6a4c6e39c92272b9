#include "viewer/finish/scale_bar.h"
#include "viewer/pbm-view/measure/polyline.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pbm {
namespace {

Polyline three_points() {
    Polyline line;
    line.add({{0, 0, 0}, 0.1});
    line.add({{3, 4, 0}, 0.2});
    line.add({{3, 4, 12}, 0.1});
    return line;
}

TEST(Polyline, AddsLengthsAndTheSquaresOfErrors) {
    Polyline line = three_points();
    EXPECT_EQ(line.segment(0).value, 5);
    EXPECT_NEAR(line.segment(0).uncertainty, std::sqrt(0.05), 1e-12);
    EXPECT_EQ(line.segment(1).value, 12);
    EXPECT_EQ(line.total().value, 17);
    EXPECT_NEAR(line.total().uncertainty, std::sqrt(0.01 + 0.16 + 0.01), 1e-12);
    line.remove_last();
    EXPECT_EQ(line.total().value, line.segment(0).value);
    EXPECT_EQ(line.total().uncertainty, line.segment(0).uncertainty);
    line.clear();
    line.remove_last();
    EXPECT_TRUE(line.points().empty());
    EXPECT_EQ(line.total().value, 0);
}

TEST(PointUncertainty, IsHalfTheDiagonalOfTheVoxelDrawn) {
    const double half_diagonal = std::sqrt(0.75);
    EXPECT_NEAR(point_uncertainty(2, 2, 1.42, 0.1), 2 * half_diagonal, 1e-12); // near: voxels of the finest level
    EXPECT_NEAR(point_uncertainty(2, 8, 1.5, 4), 6 * half_diagonal, 1e-12);    // far: at most 1.5 pixels wide
    EXPECT_NEAR(point_uncertainty(2, 8, 1.5, 100), 8 * half_diagonal, 1e-12);  // but none is larger than 8
    EXPECT_NEAR(point_uncertainty(2, 8, std::numeric_limits<double>::infinity(), 1), 8 * half_diagonal, 1e-12);
}

TEST(LengthText, ShowsTwoDigitsOfTheUncertainty) {
    EXPECT_EQ(length_text({12.3456, 0.1234}, Unit::millimetre), "12.35 ± 0.12 mm");
    EXPECT_EQ(length_text({12.3456, 1.234}, Unit::unknown), "12.3 ± 1.2 units");
    EXPECT_EQ(length_text({0.0123456, 0.000999}, Unit::metre), "0.01235 ± 0.00100 m");
    EXPECT_EQ(length_text({123456, 123.4}, Unit::foot), "123456 ± 123 ft");
    EXPECT_EQ(length_text({1, 0}, Unit::metre).substr(0, 3), "1.0"); // no division by zero, no endless text
    EXPECT_FALSE(length_text({1e308, 1e300}, Unit::metre).empty());
}

// Single-precision numbers would be half a unit off.
TEST(PointText, GeoreferencedCoordinatesKeepTheirDecimals) {
    EXPECT_EQ(point_text({{500123.456789, 8500001.234567, -12.3}, 0.0012}, Unit::metre),
              "500123.4568, 8500001.2346, -12.3000 m");
}

TEST(PolylineText, NamesPointsDistancesAndTheWhole) {
    EXPECT_EQ(polyline_text(three_points(), Unit::centimetre), "point 1: 0.00, 0.00, 0.00 cm\n"
                                                               "point 2: 3.00, 4.00, 0.00 cm\n"
                                                               "point 3: 3.00, 4.00, 12.00 cm\n"
                                                               "distance 1 to 2: 5.00 ± 0.22 cm\n"
                                                               "distance 2 to 3: 12.00 ± 0.22 cm\n"
                                                               "along all: 17.00 ± 0.42 cm\n");
    EXPECT_EQ(polyline_text({}, Unit::metre), "");
}

TEST(ScaleBar, IsTheLongestRoundLengthThatFits) {
    for (const auto &[pixel_size, text, pixels] :
         {std::tuple(0.1, "10 mm", 100.0), std::tuple(0.19, "20 mm", 20 / 0.19), std::tuple(0.049, "5 mm", 5 / 0.049),
          std::tuple(1e-6, "0.0001 mm", 100.0), std::tuple(123456.0, "1e+07 mm", 1e7 / 123456)}) {
        const ScaleBar bar = scale_bar(pixel_size, 120, Unit::millimetre);
        EXPECT_EQ(bar.text, text);
        EXPECT_NEAR(bar.pixels, pixels, 1e-9);
        EXPECT_LE(bar.pixels, 120);
        EXPECT_GT(bar.pixels, 120 / 2.5);
    }
    EXPECT_EQ(scale_bar(0.1, 120, Unit::unknown).text, "10 units");
}

} // namespace
} // namespace pbm
