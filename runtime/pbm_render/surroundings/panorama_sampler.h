// Samples the panorama along rays: an equirectangular image, infinitely far away, in linear light.
//
// The distance between rows is the same everywhere; columns converge at the poles. The sampler chooses mip levels by
// the rows, since a panorama holds no finer detail along a row near its poles than along a column. So it blurs nothing
// there.
#pragma once

#include "pbm_render/surroundings/texel_levels.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace pbm {

// Pixels of a block: mip levels change between blocks only, and the caller asks for whole blocks.
inline constexpr std::size_t kRayBlock = 16;

// The rays first, first + step, .. of `count` equal pixels side by side, as long as depth 1 takes.
struct RayRow {
    glm::vec3 first, step; // model axes
    float pixel_angle;     // radians, of the pixel in the middle of the picture
    std::size_t count;
};

// Colours of a row of pixels in linear light, with room behind for whole blocks.
struct LinearRow {
    float *red, *green, *blue;
};

class PanoramaSampler {
  public:
    PanoramaSampler(std::shared_ptr<const TiledImage> panorama, UpAxis up);

    // Samples the panorama along a direction of any length, filtered over an angle (radians): red, green, blue and 0.
    Float4 sample(glm::vec3 direction, float footprint) const;

    // Samples the panorama along a row of rays. wanted[i] says whether the caller needs the block of rays that starts
    // at i * kRayBlock; sample_row leaves the colours of other blocks as they are.
    void sample_row(const RayRow &rays, const std::uint8_t *wanted, const LinearRow &to) const;

    void retry() const { texels_.retry(); }

  private:
    TexelLevels texels_;
    glm::mat3 axes_; // from model axes to right, up, forward of a view at the middle
};

} // namespace pbm
