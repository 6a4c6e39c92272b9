// What the panorama sends along rays: equirectangular, infinitely far away. Linear light.
//
// Its rows are as far apart everywhere, its columns draw together towards the poles: mip levels are chosen by the rows,
// since a panorama has no finer detail along a row near its poles than along a column. So nothing is blurred there.
#pragma once

#include "pbm_render/surroundings/texel_levels.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace pbm {

// Mip levels are changed in the middle of a row at such columns only; also the unit in which pixels are wanted or not.
inline constexpr std::size_t kRayBlock = 16;

// Rays first, first + step, .. of equal pixels side by side, as long as depth 1 takes.
struct RayRow {
    glm::vec3 first, step; // model axes
    float pixel_angle;     // radians, of the pixel in the middle of the picture
};

class PanoramaSampler {
  public:
    PanoramaSampler(std::shared_ptr<const TiledImage> panorama, UpAxis up);

    // Along a direction of any length, filtered over an angle (radians). Red, green, blue and 0.
    Float4 sample(glm::vec3 direction, float footprint) const;

    // Along `count` rays. wanted[i]: whether anybody asks for those from i * kRayBlock on; the others may keep what
    // they have. Colours have room behind for whole blocks.
    void sample_row(const RayRow &rays, std::size_t count, const std::uint8_t *wanted, float *red, float *green,
                    float *blue) const;

    void retry() const { texels_.retry(); }

  private:
    TexelLevels texels_;
    glm::mat3 axes_; // from model axes to right, up, forward of who looks at the middle
};

} // namespace pbm
