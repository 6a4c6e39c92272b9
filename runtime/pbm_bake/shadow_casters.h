// The surface behind a model's points, made once and used for every light: what casts and receives shadows.
#pragma once

#include "pbm_format/model.h"

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

class ShadowCasters {
  public:
    // Finest level of a model.
    ShadowCasters(const Model &model, int threads);
    // Any level; `grid` is that of the model.
    ShadowCasters(const Grid &grid, const PointsOfLevel &points, int threads);
};

} // namespace pbm
