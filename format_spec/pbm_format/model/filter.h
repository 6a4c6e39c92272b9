// Which filters the streams of a chunk may have. BVG.md 5.4.1 and 5.8
#pragma once

#include "pbm_format/model/point_attributes.h"

#include <cstddef>
#include <cstdint>

namespace pbm {

enum class Filter : std::uint8_t {
    none = 0,
    mask_rank = 1,
    normal = 2,
    radius = 3,
    colour565 = 4,
    colour888 = 5,
    material = 6,
    texture = 7,
    shadow = 8,
    texels = 9 // of tiles of rasters: texel_filter.h
};

// The one filter that a stream of a chunk may have besides none.
Filter filter_of(const StreamInfo &stream, const AttributeSet &set);
// Planes of a stream of a chunk with that filter: 1 to 3, 0 for none. Those of tiles have one for each channel.
std::size_t plane_count(Filter filter);
inline constexpr std::size_t kMaxPlanes = 3;

} // namespace pbm
