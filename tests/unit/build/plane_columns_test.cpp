// Planes of several points at once: what each row holds must not depend on the others.
#include "pbm_build/normals/plane_columns.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pbm::build {
namespace {

constexpr std::size_t kNear = 10;

// Neighbours on a ring around the point, from `first` on every `step` radians, in the plane of two axes.
void ring(PlaneColumns &columns, std::size_t row, double first, double step, std::size_t right, std::size_t up) {
    for (std::size_t k = 0; k < kNear; ++k) {
        const double angle = first + step * static_cast<double>(k), radius = 1000 + 10 * static_cast<double>(k);
        columns.offsets[k][right][row] = static_cast<std::int32_t>(std::lround(radius * std::cos(angle)));
        columns.offsets[k][up][row] = static_cast<std::int32_t>(std::lround(radius * std::sin(angle)));
    }
}

TEST(PlaneColumns, EachRowHasItsOwnPlane) {
    // Rows 0 to 2: rings in the planes of the axes; 3: a fan of 90 degrees; 4: a line; others: no neighbour elsewhere.
    PlaneColumns columns;
    for (std::size_t axis = 0; axis < 3; ++axis)
        ring(columns, axis, 0.3, 0.63, (axis + 1) % 3, (axis + 2) % 3);
    ring(columns, 3, 0, 0.17, 0, 1);
    for (std::size_t k = 0; k < kNear; ++k)
        columns.offsets[k][0][4] = static_cast<std::int32_t>((k % 2 == 0 ? 1 : -1) * 100 * static_cast<int>(k + 1));
    PlaneColumns::Planes planes{};
    PlaneColumns::Column<std::uint8_t> at_border{};
    PlaneColumns::Column<float> spacing{};
    columns.fit(kNear, planes);
    columns.find_borders(kNear, planes, at_border);
    columns.measure(kLinks, spacing);
    for (std::size_t row = 0; row < 4; ++row) {
        const std::size_t across = row < 3 ? row : 2;
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(std::fabs(planes.normals[axis][row]), axis == across ? 1 : 0, 1e-12) << row;
        EXPECT_LT(planes.roughness[row], 1e-12);
        EXPECT_EQ(at_border[row], row == 3 ? 1 : 0) << row;
        EXPECT_NEAR(static_cast<double>(spacing[row]), 1035, 1);
    }
    for (std::size_t row = 4; row < PlaneColumns::kRows; ++row) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_EQ(planes.normals[axis][row], 0);
        EXPECT_EQ(planes.roughness[row], 1);
        EXPECT_EQ(spacing[row], row == 4 ? 450 : 0);
    }
}

TEST(PlaneColumns, FarNeighboursWeighLess) {
    // Nine neighbours in the plane z = 0, and one as far above it as they are away: the plane tilts little. The last
    // one has a quarter of the weight of the point itself.
    PlaneColumns columns;
    ring(columns, 0, 0, 0.7, 0, 1);
    columns.offsets[kNear - 1][2][0] = 1090;
    PlaneColumns::Planes planes{};
    columns.fit(kNear, planes);
    EXPECT_GT(std::fabs(planes.normals[2][0]), 0.97);
    EXPECT_GT(planes.roughness[0], 0.03);
    columns.fit(kNear - 1, planes);
    EXPECT_NEAR(std::fabs(planes.normals[2][0]), 1, 1e-12);
}

TEST(PlaneColumns, NoNeighboursHaveNoBorder) {
    const PlaneColumns columns;
    const PlaneColumns::Planes planes{};
    PlaneColumns::Column<std::uint8_t> at_border{};
    PlaneColumns::Column<float> spacing{};
    columns.find_borders(0, planes, at_border);
    columns.measure(0, spacing);
    EXPECT_EQ(at_border[0], 0);
    EXPECT_EQ(spacing[0], 0);
}

} // namespace
} // namespace pbm::build
