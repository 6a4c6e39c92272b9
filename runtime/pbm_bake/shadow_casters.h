// The surface behind a model's points, made once and used for every light: what casts and receives shadows.
//
// A voxel's centre lies up to 0.87 voxel edges off the surface, and a shadow map that takes it for the surface either
// shadows all its neighbours or needs a bias that lets light through. Its neighbours know better: the mean of the
// occupied voxels around a point lies near the surface, and tangent planes carry that estimate from point to point.
// What is left is 0.08 to 0.14 voxels (root mean square, on scans), instead of 0.42.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Points of one level, as views: they must outlive the ShadowCasters made of them.
struct PointsOfLevel {
    int level = kMinDepth;                  // kMinDepth..kMaxDepth; the grid has 2^level voxels per edge
    std::span<const MortonCode> codes;      // ascending, unique
    std::span<const std::uint16_t> normals; // normal index | kTwoSidedBit
    ByteView radii;                         // index into the radius table
};

// Up to 512 points in 8x8x8 voxels.
struct CasterBrick {
    std::array<std::uint16_t, 3> corner{}; // its first voxel / 8
    std::uint64_t first_point = 0;         // the last one ends where the next brick starts
};

// Centre of the voxel at a place (Morton code) of a brick, in voxels from the grid's minimum corner.
inline std::array<double, 3> voxel_centre(const CasterBrick &brick, std::uint16_t place) {
    const auto local = morton_decode(place);
    std::array<double, 3> centre{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        centre[axis] = 8.0 * brick.corner[axis] + local[axis] + 0.5;
    return centre;
}

class ShadowCasters {
  public:
    // Finest level of a model, whose normals and radii are looked at as long as this lives.
    ShadowCasters(const Model &model, int threads);
    // Any level; `grid` is that of the model. Codes are not needed any longer afterwards.
    ShadowCasters(const Grid &grid, const PointsOfLevel &points, int threads);

    std::size_t size() const { return places_.size(); }
    int level() const { return level_; }
    double voxel_size() const { return voxel_size_; } // of this level, model units
    UpAxis up() const { return up_; }

    // In Morton order, with one more at the end whose first point is size().
    std::span<const CasterBrick> bricks() const { return bricks_; }
    // Place within its brick: a Morton code of 9 bits. [size()]
    std::span<const std::uint16_t> places() const { return places_; }
    // Way from the voxel's centre along the normal to the surface, in kOffsetSteps-ths of a voxel. [size()]
    std::span<const std::int8_t> offsets() const { return offsets_; }
    std::span<const std::uint16_t> normals() const { return normals_; }
    ByteView radii() const { return radii_; }

    static constexpr int kOffsetSteps = 128;

  private:
    void find_bricks(std::span<const MortonCode> codes);
    void find_surface(int threads);

    int level_;
    double voxel_size_;
    UpAxis up_;
    std::span<const std::uint16_t> normals_;
    ByteView radii_;
    std::vector<CasterBrick> bricks_;
    std::vector<std::uint16_t> places_;
    std::vector<std::int8_t> offsets_;
};

} // namespace pbm
