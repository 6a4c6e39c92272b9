// Splats as stencils from a table: the dissertation's method to draw a disc without computing its image.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002, section 4.3;
// dissertation sections 4.2 and 5.8
#pragma once

#include "pbm_render/camera/projection.h"
#include "pbm_render/picture/framebuffer.h"

#include <glm/vec2.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace pbm {

// Index of a kernel, 10 bits:  [9..8] half of the screen's quadrant: bit 8: outer half in x, bit 9: in y
//                              [7..6] quarter of the object's depth range, front to rear
//                              [5..0] the three coarse digits of the normal without its octant
// The table holds one octant of normals in one quadrant of the screen; mirroring gives the others.
inline constexpr std::size_t kKernelCount = 1024;
inline constexpr int kKernelEdge = 16; // pixels

// Rows from the top; bit x of a row is pixel x. The disc is centred in the kernel.
using SplatKernel = std::array<std::uint16_t, kKernelEdge>;

class SplatKernels {
  public:
    // For a picture of width x height in which the object lies between the depths `front` and `rear`, 0 < front < rear.
    // `projection` maps model space to the screen.
    SplatKernels(const Projection &projection, int width, int height, double front, double rear);

    const SplatKernel &kernel(std::size_t index) const { return kernels_[index]; }

    // Draws the disc of a point at `pixel` and `depth`; `radius` in pixels, `normal` faces the eye. Radius at most 1:
    // one pixel; at most 3: 3 x 3 pixels; at most 8: the kernel; beyond: the kernel scaled by a power of two. All
    // pixels get the point's depth. Pixels outside the framebuffer are clipped.
    void draw(std::size_t normal, glm::vec2 pixel, float depth, float radius, std::uint32_t index,
              Framebuffer &target) const;

  private:
    // The digits of a normal for the index, and its signs for mirroring.
    struct NormalBits {
        std::uint8_t digits; // 6 bits
        bool left, up;       // signs of its direction on the screen
    };

    std::size_t index_of(NormalBits normal, glm::vec2 pixel, float depth) const;

    glm::vec2 middle_;                // pixels
    float front_, inverse_range_;     // depth
    std::vector<NormalBits> normals_; // [kNormalCount], or [kDrawnNormals]
    std::vector<SplatKernel> kernels_;
};

} // namespace pbm
