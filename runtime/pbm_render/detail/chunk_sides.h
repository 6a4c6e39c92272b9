// Chunks with sides (BVG.md 19.4) as they are drawn: points that stand for a thin wall show one of its sides in place,
// and their other sides are a chunk of their own. A side is drawn where it faces the eye alone (kSideBit).
#pragma once

#include "pbm_format/chunks/chunk.h"
#include "pbm_render/bricks/chunk_offsets.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Values of points and their lit fractions, which are packed as in a file.
struct SideColumns {
    PointAttributes points;
    std::array<Bytes, kMaxLights> packed_shadows;
};

struct ChunkSides {
    SideColumns first; // of all points of the chunk
    // The other sides.
    std::vector<std::uint32_t> points; // of which points of the chunk they are, ascending
    SideColumns second;                // [points]
    Bytes masks;
    std::vector<BrickRecord> bricks;
    Bytes colours; // what points show in place of their own; empty: nothing
    ChunkView view;
    ChunkOffsets offsets;

    // The range of the other sides of the chunk's points first .. last - 1.
    std::array<std::uint32_t, 2> range(std::uint32_t first_point, std::uint32_t last_point) const;

    // Upper bound of the memory that sides of a chunk with so many raw bytes take.
    static std::uint64_t memory_of(const ChunkEntry &chunk, const AttributeSet &set, std::uint64_t raw_bytes);
};

// Splits a chunk of `level`, whose points have `sides`: `view` shows the first ones, `bricks` are its bricks, whose
// normal cones become those of the first sides. `to` must outlive `view`. Accesses stay in bounds if the bytes of a
// mapped chunk change.
void split_sides(Sides sides, const AttributeSet &set, int level, std::span<BrickRecord> bricks, ChunkView &view,
                 ChunkSides &to);

} // namespace pbm
