// Where in their voxels the surface lies.
//
// A point stands for the centre of its voxel, up to 0.87 edges off the surface: 0.42 on scans (root mean square). The
// voxels around it know better, since the same surface touches them: the mean of their centres lies near it. What is
// left is 0.14 voxels, on rough scans too; splats that are moved by that have smooth outlines and true depths.
#pragma once

#include "pbm_bake/padded_brick.h"
#include "pbm_format/mapped_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace pbm {

// Of a stored offset per voxel edge; none is larger than kMostOffset.
inline constexpr float kMostOffset = 0.875F;
inline constexpr float kOffsetSteps = 127 / kMostOffset;

// Holds memory for one chunk after the other.
class SurfaceOffsets {
  public:
    SurfaceOffsets() { around_.fill({}); }

    // For each point the way from the centre of its voxel to the surface along its normal, in kOffsetSteps-ths of a
    // voxel edge; 0 for two-sided points, whose normal says nothing of where they are. It is the mean over the 27
    // voxels around whose normals are within 60 degrees of the point's: each says where the surface is if it passes
    // through that voxel's centre, bent as the two normals are; those far from the line along the normal count less.
    // Voxels of other chunks are taken to be empty. In bounds whatever the bytes of a mapped chunk became.
    // As many as the chunk has points.
    void estimate(const ChunkView &chunk, std::span<std::int8_t> to);

  private:
    struct Normal {
        float x = 0, y = 0, z = 0; // all 0: no point
    };
    struct Brick {
        std::array<std::uint32_t, 3> place;
        std::size_t first, end; // points
    };

    void list_bricks(const ChunkView &chunk);
    const Brick *find(const std::array<std::uint32_t, 3> &place) const;
    void gather(const ChunkView &chunk, const Brick &brick);
    float mean_along(const Normal &normal, std::size_t at) const;

    std::vector<Brick> bricks_;
    std::vector<std::uint16_t> places_; // [points] Morton codes within their bricks
    std::vector<std::uint32_t> table_;  // hash table of 1 + brick; 0 is free
    std::array<Normal, kPaddedVoxels> around_;
    std::vector<std::int16_t> filled_; // of around_
};

// The offsets of one chunk's points, estimated when they are first asked for.
class ChunkOffsets {
  public:
    explicit ChunkOffsets(std::size_t points);

    // `chunk` is always the same. Several threads may ask at once: one estimates, those who need the same wait.
    const std::int8_t *of(const ChunkView &chunk, SurfaceOffsets &workplace) const;

  private:
    mutable std::once_flag estimated_;
    mutable std::vector<std::int8_t> offsets_;
};

} // namespace pbm
