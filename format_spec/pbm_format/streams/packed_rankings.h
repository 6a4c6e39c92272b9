// The table of the rank filter (BVG.md 5.9) in a form that gzip makes a sixth smaller, for downloaded programs.
//
//   rankings of contexts  transposed: contexts that differ in the normal class alone lie side by side, and are alike
//   masks of a ranking    places among the masks that have no code yet, which are in an order common to all rankings:
//                         that of their mean codes, so that most places are small; those of one code side by side
#pragma once

#include "pbm_format/streams/mask_ranks.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm {

using MaskRankTable = std::array<std::uint8_t, kMaskContexts + kMaskRankings * 256>; // as mask_rank_table()

class PackedRankings {
  public:
    constexpr explicit PackedRankings(const MaskRankTable &table) {
        for (std::size_t at = 0; at < kMaskContexts; ++at)
            rankings_[transposed(at)] = table[at];
        std::array<std::uint32_t, 256> sums{};
        for (std::size_t at = 0; at < places_.size(); ++at)
            sums[table[kMaskContexts + at]] += static_cast<std::uint32_t>(at % 256);
        for (std::size_t mask = 0; mask < 256; ++mask) {
            std::size_t place = 0;
            for (std::size_t other = 0; other < 256; ++other)
                place += sums[other] < sums[mask] || (sums[other] == sums[mask] && other < mask) ? 1 : 0;
            common_order_[place] = static_cast<std::uint8_t>(mask);
        }
        FreeMasks left;
        for (std::size_t at = 0; at < places_.size(); ++at) {
            if (at % 256 == 0)
                left = {common_order_};
            std::uint8_t &place = places_[at % 256 * kMaskRankings + at / 256];
            place = left.place_of(table[kMaskContexts + at]);
            left.take(place);
        }
    }

    MaskRankTable unpacked() const {
        MaskRankTable table;
        for (std::size_t at = 0; at < kMaskContexts; ++at)
            table[at] = rankings_[transposed(at)];
        FreeMasks left;
        for (std::size_t at = 0; at < places_.size(); ++at) {
            if (at % 256 == 0)
                left = {common_order_};
            table[kMaskContexts + at] = left.take(places_[at % 256 * kMaskRankings + at / 256]);
        }
        return table;
    }

  private:
    struct FreeMasks {
        std::array<std::uint8_t, 256> masks{}; // from `first` on
        std::size_t first = 0;

        constexpr std::uint8_t place_of(std::uint8_t mask) const {
            std::size_t at = first;
            while (masks[at] != mask)
                ++at;
            return static_cast<std::uint8_t>(at - first);
        }
        constexpr std::uint8_t take(std::size_t place) {
            const std::uint8_t taken = masks[first + place];
            for (std::size_t at = first + place; at > first; --at) // few: places are small
                masks[at] = masks[at - 1];
            ++first;
            return taken;
        }
    };

    static constexpr std::size_t transposed(std::size_t context) {
        constexpr std::size_t kOfClass = kMaskContexts / kMaskNormalClasses;
        return context % kOfClass * kMaskNormalClasses + context / kOfClass;
    }

    std::array<std::uint8_t, kMaskContexts> rankings_{}; // of transposed contexts
    std::array<std::uint8_t, 256> common_order_{};
    std::array<std::uint8_t, kMaskRankings * 256> places_{}; // [code][ranking]
};

} // namespace pbm
