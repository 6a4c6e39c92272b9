// What is the same for all points of a frame: camera, normals as the eye sees them, radii. All lengths in grid edges.
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_format/model/streams.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/camera/transform_table.h"

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

// The same in one word, so that SIMD code fetches all of it at once: x, y, z as signed 9-bit numbers of 255ths from the
// highest bit down, 4 bits of inset, and the lowest bit free for a point to say that it is two-sided.
inline constexpr float kPackedNormalScale = 255;
inline constexpr std::int32_t kPackedInsetMask = 15 << 1, kPackedTwoSided = 1;
inline constexpr float kPackedInsetScale = 25 * 2;

struct FrameGeometry {
    // `projection` takes the unit grid to the screen.
    FrameGeometry(const Projection &projection, int width, int height);

    Projection projection;
    int width, height;
    float focal, inverse_focal;       // pixels
    float middle_x, middle_y;         // pixels
    std::vector<EyeNormal> normals;   // [kNormalCount]
    std::vector<std::int32_t> packed; // [kNormalCount]
    std::array<float, 256> radii;     // by radius index
    std::span<const float> thickness; // [kNormalCount] of splats, voxel edges
};

} // namespace pbm
