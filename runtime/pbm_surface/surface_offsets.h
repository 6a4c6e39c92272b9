// Estimates the surface offsets of the points of a chunk, for the renderers.
//
// A point stands for the centre of its voxel, which lies up to 0.87 edges off the surface: 0.42 on scans (root mean
// square). The mean of the occupied voxels around it lies nearer to the surface: 0.14 voxels, on rough scans too.
// Splats at these offsets have smooth outlines and true depths.
//
// The baker has its own estimate, carried_offsets.h. A renderer estimates while it draws: one pass of integers, the
// same on every SIMD target, over the voxels of one chunk, without voxels of the other side of thin walls. The baker
// runs once: two passes over the whole level leave less error on smooth parts. Replacing one by the other would change
// pixels or baked bytes. Both use brick_neighbours.h.
#pragma once

#include "pbm_format/chunks/mapped_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace pbm {

// A stored offset is even: a number of steps, kOffsetSteps per voxel edge; the largest is kMaxOffset voxel edges. Bit 0
// marks a redundant point: without such points small splats still close the surface. A point is redundant if
//
//   - the surface lies at least kRedundantDepth voxel edges behind the centre of its voxel,
//   - the next voxel behind it, along the longest axis a of its normal, has a point whose normal m is not on the other
//     side and has m.a > 0.5: so the last voxel of a row is never redundant,
//   - sum(w), see below, is at most kOneSurfaceWeight: it is larger where layers of several scans lie on each other,
//   and
//     the voxels of the front layer alone are seen there.
inline constexpr float kMaxOffset = 0.875F;
inline constexpr float kOffsetSteps = 127 / kMaxOffset;
inline constexpr float kRedundantDepth = 0.2F, kOneSurfaceWeight = 25;
// Voxel edges per unit of sum(w) beyond that of one surface: from the mean of the layers to the outermost one.
inline constexpr float kLayerLift = 0.03F;
inline constexpr std::int8_t kRedundantBit = 1;
constexpr float offset_of(std::int8_t stored) { return static_cast<float>(stored & ~kRedundantBit) / kOffsetSteps; }

// Stored offsets of a brick's points, in order; padded for whole SIMD vectors.
struct BrickOffsets {
    alignas(64) std::array<std::int8_t, 512 + 16> steps;
};

struct BrickNeighbours;

// Estimates one chunk at a time; reuses its memory for the next one.
class SurfaceOffsets {
  public:
    // Lists the bricks of a chunk. The functions below refer to this chunk.
    void begin(const ChunkView &chunk);
    // Number of the points in bricks before number `brick`, which may be the number of bricks.
    std::size_t points_before(std::uint32_t brick) const { return bricks_[brick + 1].points_before; }

    // For each point of brick number `brick`, estimates the distance from the centre of its voxel to the surface along
    // its normal n, and whether the point is redundant. Let d be the vectors to those of
    // the 27 voxels around a point that are occupied and of the same side, and w = 3 - (d.d - (n.d)^2):
    //
    //   offset = sum(w n.d) / sum(w) + kLayerLift max(sum(w) - kOneSurfaceWeight, 0)
    //
    // The first term is the mean surface. The second one is zero on a single surface. Where scans lie on each other in
    // layers that the 27 voxels hold, they are one surface for the eye: the outermost one, which lies above their mean.
    //
    // A point with normal m is of the same side if m.a > 0.5 on at least one signed axis a with n.a > 0.38, and on no
    // such axis m.a < -0.5. Two-sided points get 0, since their normal does not tell the side. Normals are rounded to 6
    // degrees, w to 1/84, w (n.d + 1.75) to 1/24, offsets to two steps; the result is the same on every machine. Voxels
    // of other chunks count as empty. Accesses stay in bounds if the bytes of a mapped chunk change. Several threads
    // may call at once.
    void estimate(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &to) const;
    // The same for all bricks of a chunk; begins it. `to`: [points]
    void estimate(const ChunkView &chunk, std::span<std::int8_t> to);

    struct Brick {
        std::uint64_t place = 0;    // x, y, z in 16 bits each
        std::uint64_t node_map = 0; // as in the BrickRecord, without nodes whose masks are missing
        std::uint32_t first_node = 0, first_point = 0, points_before = 0;
        std::uint32_t directions = 0; // bit i: the brick has points on the side of direction i (kDirectionCount)
    };

    // Bytes that the lists of a chunk of this shape take at most.
    static std::uint64_t memory_of(const ChunkShape &shape) {
        return shape.bricks * (sizeof(Brick) + 4 * sizeof(std::uint32_t)) + shape.nodes * sizeof(std::uint16_t) +
               shape.points;
    }

  private:
    const Brick &find(std::uint64_t place) const; // the empty brick if there is none
    void find_neighbours(const Brick &brick, BrickNeighbours &to) const;

    std::vector<Brick> bricks_;              // an empty brick, those of the chunk, an empty brick
    std::vector<std::uint16_t> node_points_; // [nodes]: number of the brick's points before those of the node
    std::unique_ptr<std::uint8_t[]> sides_;  // [points]: directions of their normals; padded
    std::vector<std::uint32_t> table_;       // hash table of bricks by place; 0: free slot
};

} // namespace pbm
