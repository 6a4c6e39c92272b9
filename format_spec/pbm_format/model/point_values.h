// Point values: colours as sRGB of 16 or 24 bits, with conversion to linear light for averages; splat radii as indices
// of a table with twelve steps per doubling. BVG.md 6.2 and 6.3
// Stability: stable.
#pragma once

#include "system/bytes.h"

#include <array>
#include <cstdint>
#include <span>

namespace pbm {

enum class ColourFormat : std::uint8_t { none = 0, rgb565 = 1, rgb888 = 2 };

using Rgb8 = std::array<std::uint8_t, 3>; // sRGB

constexpr Rgb8 expand_565(std::uint16_t colour) {
    const unsigned r = colour >> 11, g = colour >> 5 & 63U, b = colour & 31U;
    return {static_cast<std::uint8_t>(r << 3 | r >> 2), static_cast<std::uint8_t>(g << 2 | g >> 4),
            static_cast<std::uint8_t>(b << 3 | b >> 2)};
}
std::uint16_t pack_565(Rgb8 colour); // nearest
// Colour of point `i` of a colour stream, expanded to 8 bits by repeating the high bits; black for format none.
inline Rgb8 point_colour(const std::uint8_t *colours, std::size_t i, ColourFormat format) {
    if (format == ColourFormat::rgb888)
        return {colours[3 * i], colours[3 * i + 1], colours[3 * i + 2]};
    if (format == ColourFormat::rgb565)
        return expand_565(static_cast<std::uint16_t>(colours[2 * i] | colours[2 * i + 1] << 8));
    return {};
}
inline Rgb8 point_colour(ByteView colours, std::size_t i, ColourFormat format) {
    return point_colour(colours.data(), i, format);
}

// sRGB to linear light, 16 bits: [256], ascending from 0 to 65,535. Normative: BVG.md table 6.3.
std::span<const std::uint16_t> linear_table();
// The nearest sRGB value; ties give the lower one.
std::uint8_t linear_to_srgb(std::uint32_t linear);

// Radius of an index in units of 2^-40 of the grid's edge: edge x 2^((i - 255) / 12), rounded down. BVG.md table 6.2.
std::uint64_t radius_fixed(std::uint8_t index);
// The same as a fraction of the grid's edge.
double radius_fraction(std::uint8_t index);
// Smallest index whose radius is at least `fraction` of the grid's edge; 255 if there is none.
std::uint8_t radius_index(double fraction);
// Smallest index that covers children of radius `child_index` from the centre of a node of `level` (6.2.3): radius >=
// child's radius + sqrt(3)/4 of the node's edge.
std::uint8_t covering_radius(std::uint8_t child_index, int level);
// Maximal index at the finest level: at most 5 % of the grid's edge.
inline constexpr std::uint8_t kMaxFinestRadius = 203;

} // namespace pbm
