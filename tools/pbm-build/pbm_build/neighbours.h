// The nearest other voxels of a voxel, and points of a point. The only user of nanoflann.
#pragma once

#include "pbm_build/lattice.h"
#include "pbm_format/octree.h"

#include <memory>
#include <span>
#include <vector>

namespace pbm::build {

struct Neighbour {
    std::uint32_t voxel;    // index into the codes
    float squared_distance; // between the centres, in voxels
};

class VoxelNeighbours {
  public:
    // `codes` ascending and unique, at most 2^32 - 1.
    explicit VoxelNeighbours(std::span<const MortonCode> codes);
    ~VoxelNeighbours();

    // Fills `found` with the nearest voxels around `voxel`, itself left out, nearest first; ties by index, but
    // which of the farthest come where not all of a tie do, the tree decides. Returns how many there are (fewer than
    // asked only in a small model). At most kMost. Safe from several threads.
    static constexpr std::size_t kMost = 31;
    std::size_t nearest(std::size_t voxel, std::span<Neighbour> found) const;

  private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

struct NearPoint {
    std::uint32_t point;     // index into the points
    double squared_distance; // in lattice steps
};

class PointNeighbours {
  public:
    // At most 2^32 - 1 points, which may lie in one place.
    explicit PointNeighbours(std::vector<LatticePoint> points);
    ~PointNeighbours();

    // As VoxelNeighbours::nearest.
    static constexpr std::size_t kMost = 63;
    std::size_t nearest(std::size_t point, std::span<NearPoint> found) const;

    const std::vector<LatticePoint> &points() const;

  private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

} // namespace pbm::build
