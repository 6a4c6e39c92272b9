// Where the points of a chunk find their parents and codes, from the child masks; 16 or 32 at a time, with the best
// instructions the processor has (Highway), and the same on every processor. BVG.md 4 and 5.8.
#pragma once

#include "system/bytes.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pbm {

// Bytes that may be read behind codes, and written behind scratch memory.
inline constexpr std::size_t kSlack = 64;

struct MaskSummary {
    std::uint64_t children = 0;
    std::uint64_t only_children = 0;
    bool zero = false; // one of the masks is
};
MaskSummary summarise_masks(ByteView masks);

// Where each point finds its parent node and its code. Points stand in blocks of 16, which have at most 16 parents and
// at most 16 codes, so that a shuffle of 16 bytes hands each point its own.
class SiblingLayout {
  public:
    // For masks of which none is zero and which have `summary.children` children.
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
    // Of each point, in whole pairs of blocks: its node, counted from its block's first; and its code, counted from
    // its block's first, with bit 7 set if it has none.
    const std::uint8_t *parents() const { return parents_.data(); }
    const std::uint8_t *codes_of_points() const { return codes_of_points_.data(); }

  private:
    std::size_t nodes_ = 0, points_ = 0, codes_ = 0;
    std::vector<Block> blocks_;
    Bytes parents_, codes_of_points_;
    Bytes numbers_; // one byte before, then bits 0..7 of the number of each point's node
};

} // namespace pbm
