// Where in their voxels the surface lies.
//
// A point stands for the centre of its voxel, up to 0.87 edges off the surface: 0.42 on scans (root mean square). The
// voxels around it know better, since the same surface touches them: the mean of their centres lies near it. What is
// left is 0.14 voxels, on rough scans too; splats that are moved by that have smooth outlines and true depths.
#pragma once

#include "pbm_format/chunks/mapped_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Of a stored offset per voxel edge; none is larger than kMostOffset.
inline constexpr float kMostOffset = 0.875F;
inline constexpr float kOffsetSteps = 127 / kMostOffset;

struct BrickNeighbours;

// Holds memory for one chunk after the other.
class SurfaceOffsets {
  public:
    // For each point the way from the centre of its voxel to the surface along its normal, in kOffsetSteps-ths of a
    // voxel edge; 0 for two-sided points, whose normal says nothing of where they are. It is the mean, along the
    // normal, of the centres of those of the 27 voxels around that are occupied and of the same side: along an axis
    // that the point's normal follows by more than 0.38 of its length their normals follow it too, by more than half,
    // and along none they do so the other way. A voxel r off the line along the normal weighs 3 - r^2. Normals are
    // taken to within 6 degrees, weights to an 84th, weights x places to a 24th; the same on every machine. Voxels of
    // other chunks are taken to be empty. In bounds whatever the bytes of a mapped chunk became.
    //
    // bricks  of the chunk, by index: those whose points are estimated
    // to      of all points of the chunk; those of other bricks stay as they are
    void estimate(const ChunkView &chunk, std::span<const std::uint32_t> bricks, std::span<std::int8_t> to);
    // The same for all bricks.
    void estimate(const ChunkView &chunk, std::span<std::int8_t> to);

    struct Brick {
        std::uint64_t place = 0;    // x, y, z in 16 bits each
        std::uint64_t node_map = 0; // as in the BrickRecord
        std::uint32_t first_node = 0, first_point = 0;
        std::uint32_t ways = 0; // to neighbours that its points lie beside, of 27 as bits, x fastest
    };

  private:
    void list_bricks(const ChunkView &chunk);
    void list_sides(const ChunkView &chunk);
    const Brick &find(std::uint64_t place) const; // the first if there is none
    void find_neighbours(const Brick &brick, BrickNeighbours &to) const;

    std::vector<Brick> bricks_;             // of the chunk, behind one that is none of them
    std::vector<std::uint8_t> masks_;       // of all bricks' nodes; 0 where points are missing
    std::vector<std::uint8_t> point_sides_; // which ways normals look
    std::vector<std::uint64_t> sides_;      // the same of nodes' children, a byte each
    std::vector<std::uint32_t> table_;      // hash table of bricks by place; 0 is free
};

} // namespace pbm
