#include "pbm_format/model/octree.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

LevelMasks encode_octree(std::span<const MortonCode> codes, int depth) {
    assert(depth >= 1 && depth <= kMaxDepth && !codes.empty());
    LevelMasks masks(static_cast<std::size_t>(depth) + 1);
    // One pass over the finest codes: sets a mask bit at each level where the path differs from the previous code's.
    MortonCode previous = ~MortonCode{0};
    for (const MortonCode code : codes) {
        assert(previous == ~MortonCode{0} || previous < code);
        for (int level = depth; level >= 1; --level) {
            const int shift = 3 * (depth - level);
            if (previous != ~MortonCode{0} && previous >> shift == code >> shift)
                break;
            const bool new_parent = previous == ~MortonCode{0} || previous >> (shift + 3) != code >> (shift + 3);
            const auto bit = static_cast<std::uint8_t>(1U << (code >> shift & 7));
            Bytes &level_masks = masks[static_cast<std::size_t>(level)];
            if (new_parent)
                level_masks.push_back(bit);
            else
                level_masks.back() = static_cast<std::uint8_t>(level_masks.back() | bit);
        }
        previous = code;
    }
    return masks;
}

std::uint64_t count_children(ByteView masks) {
    std::uint64_t count = 0;
    std::size_t i = 0;
    while (i + 8 <= masks.size()) {
        // Each byte sums counts of at most 8; 31 rounds cannot overflow it.
        std::uint64_t sums = 0;
        for (const std::size_t end = i + 8 * std::min<std::size_t>(31, (masks.size() - i) / 8); i < end; i += 8) {
            std::uint64_t eight;
            std::memcpy(&eight, masks.data() + i, 8);
            eight -= eight >> 1 & 0x5555555555555555;
            eight = (eight & 0x3333333333333333) + (eight >> 2 & 0x3333333333333333);
            sums += (eight + (eight >> 4)) & 0x0F0F0F0F0F0F0F0F;
        }
        count += ((sums & 0x00FF00FF00FF00FF) + (sums >> 8 & 0x00FF00FF00FF00FF)) * 0x0001000100010001 >> 48;
    }
    for (; i < masks.size(); ++i)
        count += kChildren[masks[i]];
    return count;
}

Result<std::vector<MortonCode>> expand_level(std::span<const MortonCode> parents, ByteView masks,
                                             std::size_t max_codes) {
    if (parents.size() != masks.size())
        return broken("4.3", std::min(parents.size(), masks.size()),
                      "the number of masks is not the number of nodes above", parents.size(), masks.size());
    const auto zero = std::find(masks.begin(), masks.end(), std::uint8_t{0});
    if (zero != masks.end())
        return broken("4.2", static_cast<std::uint64_t>(zero - masks.begin()), "zero child mask", "1..255", 0);
    const std::uint64_t count = count_children(masks);
    if (count > max_codes)
        return broken("4.5", masks.size(), "more nodes than allowed", "at most " + std::to_string(max_codes), count);
    std::vector<MortonCode> codes;
    codes.reserve(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < masks.size(); ++i)
        for (unsigned mask = masks[i]; mask != 0; mask &= mask - 1)
            codes.push_back(parents[i] << 3 | static_cast<unsigned>(std::countr_zero(mask)));
    return codes;
}

std::vector<std::vector<std::uint64_t>> subtree_starts(const LevelMasks &masks, int root_level) {
    const int depth = static_cast<int>(masks.size()) - 1;
    assert(root_level >= 0 && root_level <= depth);
    std::vector<std::vector<std::uint64_t>> starts(masks.size());
    const auto roots =
        static_cast<std::size_t>(root_level == 0 ? 1 : count_children(masks[static_cast<std::size_t>(root_level)]));
    std::vector<std::uint64_t> here(roots + 1);
    for (std::size_t i = 0; i <= roots; ++i)
        here[i] = i;
    starts[static_cast<std::size_t>(root_level)] = here;
    for (int level = root_level + 1; level <= depth; ++level) {
        const ByteView level_masks = masks[static_cast<std::size_t>(level)];
        std::vector<std::uint64_t> below(roots + 1, 0);
        for (std::size_t i = 0; i < roots; ++i)
            below[i + 1] = below[i] + count_children(slice(level_masks, here[i], here[i + 1] - here[i]));
        starts[static_cast<std::size_t>(level)] = below;
        here = std::move(below);
    }
    return starts;
}

} // namespace pbm
