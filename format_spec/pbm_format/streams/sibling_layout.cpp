#include "pbm_format/streams/sibling_layout.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_format/streams/sibling_layout.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "system/simd/byte_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

MaskSummary summarise_masks(ByteView masks) {
    MaskSummary summary;
    std::size_t at = 0;
    for (; at + kLanes <= masks.size(); at += kLanes) {
        const Lanes some = load(masks.data() + at);
        std::array<std::uint64_t, kLanes / 8> eights{};
        std::memcpy(eights.data(), masks.data() + at, kLanes);
        for (const std::uint64_t eight : eights)
            summary.children += static_cast<unsigned>(std::popcount(eight));
        summary.only_children += count_lanes(equal_lanes(some & (some - set(1)), set(0)));
        summary.zero |= equal_lanes(some, set(0)) != 0;
    }
    for (; at < masks.size(); ++at) {
        summary.children += static_cast<unsigned>(std::popcount(masks[at]));
        summary.only_children += (masks[at] & (masks[at] - 1U)) == 0 ? 1U : 0U;
        summary.zero |= masks[at] == 0;
    }
    return summary;
}

// Writes the low 8 bits of each point's node number, eight bytes per node; the next node overwrites the surplus.
void number_parents(ByteView masks, std::uint8_t *numbers) {
    constexpr std::uint64_t kOnes = 0x0101010101010101;
    for (std::size_t node = 0; node < masks.size(); ++node) {
        const std::uint64_t eight = (node & 255) * kOnes;
        std::memcpy(numbers, &eight, 8);
        numbers += std::popcount(masks[node]);
    }
}

// A point has siblings if a neighbour has the same parent. `numbers` is padded by one byte in front and kSlack behind,
// the other arrays to whole strides.
void lay_out_siblings(const std::uint8_t *numbers, std::size_t points, SiblingLayout::Block *blocks,
                      std::uint8_t *parents, std::uint8_t *codes_of_points) {
    std::uint32_t first_node = 0, first_code = 0;
    for (std::size_t at = 0; at < points; at += kLanes) {
        const Lanes number = load(numbers + at);
        const Lanes siblings =
            equal_bytes(number, load(numbers + at - 1)) | equal_bytes(number, load(numbers + at + 1));
        const Lanes one = siblings & set(1);
        Lanes codes = one; // inclusive prefix sums within a block
        codes = codes + shift_lanes<1>(codes);
        codes = codes + shift_lanes<2>(codes);
        codes = codes + shift_lanes<4>(codes);
        codes = codes + shift_lanes<8>(codes);
        std::uint8_t counts[kLanes];
        store(codes, counts);
        store((number - lookup(number, set(0))) & set(15), parents + at);
        store(((codes - one) & set(15)) | (set(128) - (siblings & set(128))), codes_of_points + at);
        for (std::size_t block = 0; block < kLanes; block += kBlock) {
            *blocks++ = {first_node, first_code};
            if (at + block + kBlock >= points)
                continue; // a block that only pads the stride repeats this one
            first_node += static_cast<std::uint8_t>(numbers[at + block + kBlock] - numbers[at + block]);
            first_code += counts[block + kBlock - 1];
        }
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(summarise_masks);
HWY_EXPORT(number_parents);
HWY_EXPORT(lay_out_siblings);

MaskSummary summarise_masks(ByteView masks) { return HWY_DYNAMIC_DISPATCH(summarise_masks)(masks); }

void SiblingLayout::build(ByteView masks, const MaskSummary &summary) {
    assert(!summary.zero);
    nodes_ = masks.size();
    points_ = static_cast<std::size_t>(summary.children);
    codes_ = points_ - static_cast<std::size_t>(summary.only_children);
    const std::size_t room = points_ + kSlack;
    numbers_.resize(std::max(numbers_.size(), 1 + room));
    parents_.resize(std::max(parents_.size(), room));
    codes_of_points_.resize(std::max(codes_of_points_.size(), room));
    blocks_.resize(std::max(blocks_.size(), room / 16));
    std::uint8_t *numbers = numbers_.data() + 1;
    HWY_DYNAMIC_DISPATCH(number_parents)(masks, numbers);
    // Make sure that the first and the last point have no siblings outside.
    numbers[-1] = static_cast<std::uint8_t>(numbers[0] - 1);
    numbers[points_] = static_cast<std::uint8_t>(numbers[points_ - 1] + 1);
    HWY_DYNAMIC_DISPATCH(lay_out_siblings)
    (numbers, points_, blocks_.data(), parents_.data(), codes_of_points_.data());
}

} // namespace pbm
#endif // HWY_ONCE
