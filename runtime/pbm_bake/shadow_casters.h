// The surface of a model's points, which casts and receives shadows. It is computed once and used for every light.
//
// A voxel's centre lies up to 0.87 voxel edges off the surface. A shadow map of voxel centres either shadows all
// neighbours or needs a bias that lets light through. So each point has a surface offset:
// pbm_surface/carried_offsets.h.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace pbm {

struct CarriedOffsets; // pbm_surface/carried_offsets.h
struct LevelBrick;

// Views of the points of one level.
struct PointsOfLevel {
    int level = kMinDepth;                  // kMinDepth..kMaxDepth; the grid has 2^level voxels per edge
    std::span<const MortonCode> codes;      // ascending, unique
    std::span<const std::uint16_t> normals; // normal index | kTwoSidedBit
    ByteView radii;                         // index into the radius table
    bool closed = false;                    // as ModelParameters has it
};

class ShadowCasters {
  public:
    // Takes the finest level of a model, whose normals and radii must outlive the casters.
    ShadowCasters(const Model &model, int threads);
    // Takes any level; `grid` is that of the model. The codes need not outlive the constructor.
    ShadowCasters(const Grid &grid, const PointsOfLevel &points, int threads);
    ~ShadowCasters();

    std::size_t size() const { return places_.size(); }
    int level() const { return level_; }
    double voxel_size() const { return voxel_size_; } // of this level, model units
    UpAxis up() const { return up_; }

    // In Morton order; a sentinel at the end has first_point = size().
    std::span<const LevelBrick> bricks() const;
    // Position of each point within its brick: a Morton code of 9 bits. [size()]
    std::span<const std::uint16_t> places() const { return places_; }
    // The surface, which casts shadows, and the layers above it, whose outermost one receives them: where scans lie on
    // each other they are one surface. [size()]
    const CarriedOffsets &offsets() const { return *offsets_; }
    std::span<const std::uint16_t> normals() const { return normals_; }
    // Whether a light that the point's normal faces away from may reach its back. The back of a closed surface is never
    // seen, and none of its points is lit from there.
    bool has_two_sides(std::size_t point) const { return !closed_ || (normals_[point] & kTwoSidedBit) != 0; }
    ByteView radii() const { return radii_; }

  private:
    void find_bricks(std::span<const MortonCode> codes);

    int level_;
    double voxel_size_;
    UpAxis up_;
    bool closed_;
    std::span<const std::uint16_t> normals_;
    ByteView radii_;
    std::vector<LevelBrick> bricks_;
    std::vector<std::uint16_t> places_;
    std::unique_ptr<const CarriedOffsets> offsets_;
};

} // namespace pbm
