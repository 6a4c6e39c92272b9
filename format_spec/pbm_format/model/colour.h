// Colours of points: sRGB of 16 or 24 bits, and linear light to average them in. BVG.md 6.3
#pragma once

#include "system/bytes.h"

#include <array>
#include <cstdint>
#include <span>

namespace pbm {

enum class ColourFormat : std::uint8_t { none = 0, rgb565 = 1, rgb888 = 2 };

using Rgb8 = std::array<std::uint8_t, 3>; // sRGB

Rgb8 expand_565(std::uint16_t colour);
std::uint16_t pack_565(Rgb8 colour); // nearest
// Colour of point `i` of a colour stream, expanded to 8 bits per channel by repeating the high bits; black without.
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
// The sRGB value whose linear value is nearest; ties go to the lower one.
std::uint8_t linear_to_srgb(std::uint32_t linear);

} // namespace pbm
