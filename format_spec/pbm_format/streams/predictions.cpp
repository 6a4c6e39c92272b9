#include "pbm_format/streams/predictions.h"

#include "pbm_format/model/octree.h"
#include "pbm_format/model/point_values.h"

#include <algorithm>
#include <cassert>
#include <optional>

namespace pbm {

const std::array<std::uint8_t, 256> &radius_predictions(int level, bool finest) {
    assert(level >= 1 && level <= kMaxDepth);
    thread_local std::array<std::array<std::optional<std::array<std::uint8_t, 256>>, 2>, kMaxDepth + 1> known;
    auto &predictions = known[static_cast<std::size_t>(level)][finest ? 1 : 0];
    if (predictions)
        return *predictions;
    predictions.emplace();
    const unsigned most = finest ? kMaxFinestRadius : 255U;
    unsigned child = 0;
    for (unsigned parent = 0; parent < 256; ++parent) {
        while (child < most && covering_radius(static_cast<std::uint8_t>(child + 1), level - 1) <= parent)
            ++child;
        (*predictions)[parent] = static_cast<std::uint8_t>(child);
    }
    return *predictions;
}

std::array<std::uint8_t, 256> shadow_predictions(unsigned parent_bits, unsigned bits) {
    const unsigned parent_scale = (1U << parent_bits) - 1, scale = (1U << bits) - 1;
    std::array<std::uint8_t, 256> predictions{};
    for (unsigned parent = 0; parent < 256; ++parent)
        predictions[parent] =
            static_cast<std::uint8_t>((2 * std::min(parent, parent_scale) * scale + parent_scale) / (2 * parent_scale));
    return predictions;
}

} // namespace pbm
