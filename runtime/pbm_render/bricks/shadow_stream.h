// The lit fractions of one light for the points of a run: of the file, baked anew, or 1 everywhere.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/point_run.h"

#include <array>

namespace pbm {

struct ShadowStream {
    const std::uint8_t *values = nullptr;   // of the run's chunk
    std::uint8_t bits = 1;                  // of a lit fraction
    const std::uint32_t *origins = nullptr; // of second sides: whose value they have; null: their own

    // 0..1
    float lit(std::size_t point) const {
        constexpr std::array<float, 9> kScales{0,         1,         1 / 3.0F,   1 / 7.0F,  1 / 15.0F,
                                               1 / 31.0F, 1 / 63.0F, 1 / 127.0F, 1 / 255.0F};
        return static_cast<float>(shadow_value(values, origins == nullptr ? point : origins[point], bits)) *
               kScales[bits];
    }
};

// One lit bit for each point of a chunk.
inline constexpr std::array<std::uint8_t, kDefaultChunkPoints / 8> kAllLit = [] {
    std::array<std::uint8_t, kDefaultChunkPoints / 8> bits{};
    bits.fill(255);
    return bits;
}();

// `light` has a shadow stream in the attribute set. Fresh lit fractions that do not belong to the model are ignored.
inline ShadowStream shadow_stream(const PointRun &run, std::size_t light, const AttributeSet &set,
                                  const ShadowSource &source) {
    const auto level = static_cast<std::size_t>(run.level);
    if (source.of_file)
        return {run.chunk->shadows[light].data(), set.shadow_bits[light][level]};
    if (source.fresh && level < source.fresh->levels.size()) {
        const Bytes &values = source.fresh->levels[level];
        const std::uint64_t first = run.entry->first_point;
        if (first <= values.size() && run.entry->shape.points <= values.size() - first)
            return {values.data() + first, 8, run.origins};
    }
    return {kAllLit.data(), 1};
}

} // namespace pbm
