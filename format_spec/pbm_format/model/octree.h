// Octree topology as bytes, level by level: one child mask per node. BVG.md 4.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002
//
//   level 0        [root]                  masks[1] = { mask of the root }            1 byte
//   level 1     [o0] [o3] ..               masks[2] = { mask of o0, mask of o3, .. }  one byte per octant
//   level 2   [..][..] [..]                masks[3] = ...
//
// Bit i of a mask: child i exists; i = x + 2 y + 4 z of the child's half. Nodes of every level are in Morton order, so
// a depth-first walk needs only one cursor per level.
// Stability: stable.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

inline constexpr int kMinDepth = 2;
inline constexpr int kMaxDepth = 16;

// Node address inside a level: x, y, z bits interleaved, x lowest; 3 * level bits used.
using MortonCode = std::uint64_t;

// Moves the low 21 bits of `v` to every third bit, and back.
constexpr std::uint64_t spread_bits(std::uint64_t v) {
    v &= 0x1FFFFF;
    v = (v | v << 32) & 0x1F00000000FFFF;
    v = (v | v << 16) & 0x1F0000FF0000FF;
    v = (v | v << 8) & 0x100F00F00F00F00F;
    v = (v | v << 4) & 0x10C30C30C30C30C3;
    v = (v | v << 2) & 0x1249249249249249;
    return v;
}
constexpr std::uint32_t gather_bits(std::uint64_t v) {
    v &= 0x1249249249249249;
    v = (v | v >> 2) & 0x10C30C30C30C30C3;
    v = (v | v >> 4) & 0x100F00F00F00F00F;
    v = (v | v >> 8) & 0x1F0000FF0000FF;
    v = (v | v >> 16) & 0x1F00000000FFFF;
    v = (v | v >> 32) & 0x1FFFFF;
    return static_cast<std::uint32_t>(v);
}

constexpr MortonCode morton_encode(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}
constexpr std::array<std::uint32_t, 3> morton_decode(MortonCode code) {
    return {gather_bits(code), gather_bits(code >> 1), gather_bits(code >> 2)};
}

// Child masks of every level; `masks[L]` describes the nodes of level L - 1, `masks[0]` is empty.
using LevelMasks = std::vector<Bytes>;

// Masks of all levels of the octree whose finest nodes are `codes` (ascending, unique, not empty).
LevelMasks encode_octree(std::span<const MortonCode> codes, int depth);

// Codes of level L, ascending, from those of level L - 1 and the masks between them. `masks` may be untrusted.
//
// errors  truncated (4.3)  masks and parents differ in number
//         bad_octree (4.2) a mask is zero
//         too_large (4.5)  more than `max_codes` children
Result<std::vector<MortonCode>> expand_level(std::span<const MortonCode> parents, ByteView masks,
                                             std::size_t max_codes);

// Number of children of a mask. A table, since some processors lack an instruction that counts bits.
inline constexpr std::array<std::uint8_t, 256> kChildren = [] {
    std::array<std::uint8_t, 256> children{};
    for (unsigned mask = 0; mask < children.size(); ++mask)
        children[mask] = static_cast<std::uint8_t>(std::popcount(mask));
    return children;
}();

// Sum of the children of `masks`.
std::uint64_t count_children(ByteView masks);

// Starts of the subtrees below the nodes of level `root_level`: result[L][i] is the index, among the nodes of level L
// >= root_level, of the first descendant of node i; result[L] ends with the number of nodes of level L. Entries of
// levels coarser than `root_level` are empty. Level 1 gives the eight octant grids.
std::vector<std::vector<std::uint64_t>> subtree_starts(const LevelMasks &masks, int root_level);

// One chunk of a level: a maximal subtree with at most N points of that level. BVG.md 5.
struct ChunkShape {
    std::uint8_t root_depth = 0;    // level of the chunk's root
    MortonCode root_prefix = 0;     // Morton code of the root within its level
    std::uint32_t points = 0;       // nodes of level L below the root: the points of the chunk
    std::uint32_t nodes = 0;        // nodes of level L - 1: the masks of the chunk
    std::uint32_t parents = 0;      // nodes of level L - 2 (0 for L = 1)
    std::uint32_t bricks = 0;       // nodes of level L - 3 (1 for L < 3)
    std::uint32_t parent_chunk = 0; // chunk of level L - 1 that holds `nodes` (0 for L = 1)

    bool operator==(const ChunkShape &) const = default;
};

} // namespace pbm
