// Values that all points of a frame share: camera, normals in eye space, radii. All lengths in grid edges.
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_format/model/streams.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/camera/projection.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Eye space: x to the right, y down, z along the view direction.
struct EyeNormal {
    float x, y, z;
    float inset; // ScreenNormal::inset
};

// An EyeNormal in one word, so that SIMD code fetches it at once. From the highest bit: x, y, z as signed 9-bit
// multiples of 1/255, 4 bits of inset, and one bit that a point sets if it is two-sided.
inline constexpr float kPackedNormalScale = 255;
inline constexpr std::int32_t kPackedInsetMask = 15 << 1, kPackedTwoSided = 1;
inline constexpr float kPackedInsetScale = 25 * 2;
inline constexpr std::int32_t kPackedFacing = -255 * (1 << 5) & 0x3FE0; // (0, 0, -1), no inset

struct FrameGeometry {
    // `projection` maps the unit grid to the screen.
    FrameGeometry(const Projection &projection, int width, int height);

    Projection projection;
    int width, height;
    float focal, inverse_focal;       // pixels
    float middle_x, middle_y;         // pixels
    std::vector<EyeNormal> normals;   // [kNormalCount], or [kDrawnNormals]
    std::vector<std::int32_t> packed; // the same
    std::int32_t normal_mask;         // of their indices
    std::array<float, 256> radii;     // by radius index
    std::span<const float> thickness; // [kNormalCount] of splats, voxel edges
    bool shows_backs;                 // points that face away are drawn, too
};

} // namespace pbm
