// The colour of an image on a triangle, as the mean over a voxel.
#pragma once

#include "pbm_build/images/texture_pyramid.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <optional>

namespace pbm::build {

// Where a voxel is smaller than a texel, the colour is interpolated between texels. Elsewhere it is the mean of four
// places, half a voxel apart and inside the triangle, each of the level whose texels are about half a voxel wide. An
// image that is stretched is read at the level of its mean size.
class TriangleTexture {
  public:
    // `corners`: in voxel units. Refers to `pyramid`.
    void set(const TexturePyramid &pyramid, const TextureCorners &texture, const std::array<glm::dvec3, 3> &corners);

    // Linear light, or another number, 0..65,535, around the place with these weights of the corners; nothing where the
    // image cuts a hole.
    // `opacity`: of the vertices there, 0..1; counts if the image is_faded.
    std::optional<std::array<std::int32_t, 3>> colour(const std::array<double, 3> &weights, double opacity = 1) const;
    bool is_faded() const { return pyramid_->is_faded(); }
    bool is_tinted() const { return pyramid_->is_tinted(); }
    float relief() const { return pyramid_->relief(); }

  private:
    using Weights = std::array<double, 3>;
    static constexpr std::size_t kTaps = 4;

    std::optional<std::array<std::int32_t, 3>> interpolated(const glm::dvec2 &at, double most_cut) const;
    glm::dvec2 place_of(const Weights &weights) const;

    const TexturePyramid *pyramid_ = nullptr;
    const TexturePyramid::Level *level_ = nullptr;
    std::array<glm::dvec2, 3> corners_{}; // in texels of the level
    std::array<Weights, 2> steps_{}; // of the corners' weights: a quarter of a voxel along two directions of the plane
    bool is_magnified_ = false;
};

} // namespace pbm::build
