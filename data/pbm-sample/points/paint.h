// Colours of four points at a time.
#pragma once

#include "pbm-sample/noise/jet.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace pbm::sample {

struct Paint {
    Float4 red, green, blue; // sRGB, 0 to 255
};

inline Paint paint(float red, float green, float blue) { return {all(red), all(green), all(blue)}; }

inline Paint mix(const Paint &a, const Paint &b, Float4 t) {
    return {mix(a.red, b.red, t), mix(a.green, b.green, t), mix(a.blue, b.blue, t)};
}

// One point's colour, times `light`.
inline std::array<std::uint8_t, 3> color_of(const Paint &paint, int lane, float light) {
    const auto channel = [light](float value) {
        return static_cast<std::uint8_t>(std::clamp(value * light, 0.0f, 255.0f) + 0.5f);
    };
    return {channel(paint.red[lane]), channel(paint.green[lane]), channel(paint.blue[lane])};
}

} // namespace pbm::sample
