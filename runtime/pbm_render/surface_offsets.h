// Where in their voxels the surface lies.
//
// A point stands for the centre of its voxel, up to 0.87 edges off the surface: 0.42 on scans (root mean square). The
// voxels around it know better, since all of them touch the surface: the mean of their centres lies near it. What is
// left is 0.16 voxels, on rough scans too; splats that are moved by that have smooth outlines and true depths.
#pragma once

#include "pbm_format/mapped_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pbm {

// Of a stored offset per voxel edge; none is larger than kMostOffset.
inline constexpr float kMostOffset = 0.875F;
inline constexpr float kOffsetSteps = 127 / kMostOffset;

// Holds memory for one chunk after the other.
class SurfaceOffsets {
  public:
    // For each point the way from the centre of its voxel to the surface along its normal, in kOffsetSteps-ths of a
    // voxel edge; 0 for two-sided points, whose normal says nothing of where they are. Voxels of other chunks are taken
    // to be empty. About 25 ns per point. In bounds whatever the bytes of a mapped chunk became.
    void estimate(const ChunkView &chunk, std::vector<std::int8_t> &to);

  private:
    // Rows along x, padded on all sides by one voxel.
    static constexpr std::size_t kBrick = 8, kPadded = kBrick + 2, kStride = 16;
    static constexpr std::size_t kSlice = kPadded * kStride, kSumSlice = kBrick * kStride;
    using Rows = std::array<std::array<std::uint8_t, kBrick>, kBrick>; // [z][y], bit x

    void find_rows(const ChunkView &chunk);
    const Rows *find(std::uint32_t x, std::uint32_t y, std::uint32_t z) const;
    void gather(std::size_t brick);
    void add_up();
    std::int8_t offset(std::uint16_t normal, std::size_t place) const;

    std::vector<std::array<std::uint32_t, 3>> places_; // [bricks]
    std::vector<Rows> rows_;                           // [bricks]
    std::vector<std::uint32_t> table_;                 // hash table of 1 + brick; 0 is free
    // [z][y][kStride] of a brick: whether voxels are occupied; sums over 3x3x3 of them of x, y, z and 1.
    alignas(64) std::array<std::int8_t, kPadded * kSlice + kStride> occupied_{};
    alignas(64) std::array<std::array<std::int8_t, kBrick * kSumSlice>, 4> sums_{};
};

} // namespace pbm
