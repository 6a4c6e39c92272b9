// Computes the parents and codes of a chunk's points from its child masks, 16 or 32 points at a time. SIMD (Highway);
// the result is the same on every processor. BVG.md 4 and 5.8
#pragma once

#include "system/bytes.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pbm {

// Bytes that may be read behind codes and written behind scratch memory.
inline constexpr std::size_t kSlack = 64;

struct MaskSummary {
    std::uint64_t children = 0;
    std::uint64_t only_children = 0;
    bool zero = false; // a mask is zero
};
MaskSummary summarise_masks(ByteView masks);

// The parent node and the code of each point. Points are in blocks of 16 with at most 16 parents and 16 codes, so that
// a shuffle of 16 bytes selects each point's own.
class SiblingLayout {
  public:
    // `masks` must have `summary.children` children and no zero.
    void build(ByteView masks, const MaskSummary &summary);

    std::size_t nodes() const { return nodes_; }
    std::size_t points() const { return points_; }
    std::size_t codes() const { return codes_; } // points with siblings

    struct Block {
        std::uint32_t first_node = 0;
        std::uint32_t first_code = 0;
    };
    // [points / 16, rounded up to an even number]
    const Block *blocks() const { return blocks_.data(); }
    // For each point, padded to whole pairs of blocks: its node relative to the block's first node, and its code
    // relative to the block's first code; bit 7 is set if it has no code.
    const std::uint8_t *parents() const { return parents_.data(); }
    const std::uint8_t *codes_of_points() const { return codes_of_points_.data(); }

  private:
    std::size_t nodes_ = 0, points_ = 0, codes_ = 0;
    std::vector<Block> blocks_;
    Bytes parents_, codes_of_points_;
    Bytes numbers_; // one byte in front; then the low 8 bits of each point's node number
};

} // namespace pbm
