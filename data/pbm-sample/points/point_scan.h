// A scan without faces that is made where it is asked for: any part of it, in any order, without the parts before.
#pragma once

#include "pbm-sample/noise/noise.h"

#include <array>
#include <cstdint>
#include <functional>
#include <span>

namespace pbm::sample {

struct ScanPoint {
    std::array<float, 3> position;     // metres, right-handed, +Y up
    std::array<float, 3> normal;       // unit, outwards: of the surface without the scanner's noise
    std::array<std::uint8_t, 3> color; // sRGB
};

// Rounding to single precision moves a point by at most 1/50 of the distance between points.
inline constexpr std::uint64_t kMaxPoints = 100'000'000'000;

struct PointScan {
    std::uint64_t points = 0;
    double spacing = 0; // metres: sqrt(area / points)
    // Makes the points from number `first` on, one for each element of `out`. Thread-safe. A point depends on its
    // number alone, not on the call that makes it.
    std::function<void(std::uint64_t first, std::span<ScanPoint> out)> fill;
};

// What is random about a point.
struct Scatter {
    double across, along; // place in its cell, in [0.1, 0.9]: points of neighbouring cells keep their distance
    float error, shade;   // noise of position and brightness, uniform in [-1, 1)
};

inline Scatter scatter_of(std::uint64_t point, std::uint32_t seed) {
    const std::uint64_t bits = hash_bits(seed ^ hash_bits(point));
    return {0.1 + 0.8 * 0x1p-18 * static_cast<double>(bits & 0x3ffff),
            0.1 + 0.8 * 0x1p-18 * static_cast<double>(bits >> 18 & 0x3ffff),
            0x1p-13f * static_cast<float>(bits >> 36 & 0x3fff) - 1.0f,
            0x1p-13f * static_cast<float>(bits >> 50) - 1.0f};
}

} // namespace pbm::sample
