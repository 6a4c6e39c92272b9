// What a surface with images of materials shows, and how much of it: the input of its clusters.
#pragma once

#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/surface/surface.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace pbm::build {

// What a material follows from: roughness; its complement times metal, and times specular (conventions/reflectance.h);
// the share of the colour that the surface emits; the share of ambient light that does not arrive.
inline constexpr std::size_t kLookParts = 5;
using Look = std::array<std::int32_t, kLookParts>;      // 0..65,535
using LookTexel = std::array<std::uint8_t, kLookParts>; // 0..255

// The look of what only reflects: it emits nothing, and all ambient light arrives.
inline LookTexel reflecting(const ReflectanceTexel &texel) { return {texel[0], texel[1], texel[2], 0, 0}; }

inline Look look_of(const LookTexel &texel) {
    Look look{};
    for (std::size_t c = 0; c < kLookParts; ++c)
        look[c] = texel[c] * 257; // 65,535 / 255
    return look;
}

// Looks are read in cells: 32 x 32 x 32 of the first three parts, and 8 x 8 of the others, which begin and end with
// their limits. Where no image says anything of the others, looks lie in the first kReflectanceCells.
inline constexpr int kReflectanceBits = 15, kStepBits = 3;
inline constexpr std::size_t kReflectanceCells = std::size_t{1} << kReflectanceBits;
inline constexpr std::size_t kLookCells = kReflectanceCells << 2 * kStepBits;
inline constexpr std::int32_t kLastStep = (1 << kStepBits) - 1;

inline std::size_t look_cell(const Look &look) {
    const auto part = [&](std::size_t c) { return static_cast<std::size_t>(look[c]) >> 11; };
    const auto step = [&](std::size_t c) {
        return static_cast<std::size_t>((look[c] * kLastStep + 32767) / 65535) << kReflectanceBits;
    };
    return step(4) << kStepBits | step(3) | part(0) << 10 | part(1) << 5 | part(2);
}

// Adds emitted light to a colour, both linear, 0..65,535. Returns the share of the sum's luminance that is emitted,
// 0..65,535: so much of the sum is there without any light.
inline std::int32_t add_emission(const std::array<std::int32_t, 3> &light, std::array<std::int32_t, 3> &colour) {
    constexpr std::int32_t kWhite = 65535;
    // Based on: ITU-R BT.709-6. 2015
    const auto luminance = [](const std::array<std::int32_t, 3> &of) {
        return std::int64_t{13933} * of[0] + std::int64_t{46871} * of[1] + std::int64_t{4732} * of[2];
    };
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = std::min(colour[c] + light[c], kWhite);
    const std::int64_t all = luminance(colour);
    return all == 0 ? 0 : static_cast<std::int32_t>(std::min<std::int64_t>(luminance(light) * kWhite / all, kWhite));
}

// What a surface shows of a cell. Integers, so that no order matters.
struct LookSums {
    std::uint64_t weight = 0; // parts of the surface's area
    std::array<std::uint64_t, kLookParts> parts{};

    void add(const LookTexel &texel, std::uint64_t count) {
        weight += count;
        for (std::size_t c = 0; c < kLookParts; ++c)
            parts[c] += count * texel[c];
    }
};

// Whether images say more of its materials than how they reflect.
bool has_more_than_reflectance(const Surface &surface);

// The cells of looks that a surface shows, in their order: those of its images, and of its materials with reflectance.
std::vector<LookSums> sum_looks(const Surface &surface, int threads);

} // namespace pbm::build
