// Phong reflection per normal instead of per point. All values are linear light; only inputs and outputs are sRGB.
// Based on: Phong. Illumination for Computer Generated Pictures. 1975; dissertation sections 4.2 and 4.6
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/picture/framebuffer.h"

#include <glm/vec3.hpp>

#include <vector>

namespace pbm {

// What a light adds to the reflection of a point: kd * diffuse + ks * specular, times the light's intensity.
// `to_light` and `to_eye` are unit vectors.
glm::vec3 phong(const Material &material, const Light &light, glm::vec3 normal, glm::vec3 to_light, glm::vec3 to_eye);

// Reflection of directional lights for one view direction, as factors of a point's linear colour. The eye counts as
// infinitely far away, so that the table is the same for all points.
class ShadeTable {
  public:
    // Lights with an index below `shadowed_lights` have a shadow stream and are stored separately.
    ShadeTable(std::span<const Material> materials, std::span<const Light> lights, int shadowed_lights,
               glm::vec3 to_eye);

    // Red, green, blue, unused: the ambient term and all unshadowed directional lights.
    const Float4 &unshadowed(std::size_t material, std::size_t normal) const {
        return unshadowed_[material * kNormalCount + normal];
    }
    // One shadowed directional light; zero for other kinds.
    const Float4 &shadowed(std::size_t light, std::size_t material, std::size_t normal) const {
        return shadowed_[(light * materials_ + material) * kNormalCount + normal];
    }

  private:
    std::size_t materials_;
    std::vector<Float4> unshadowed_; // [materials][kNormalCount]
    std::vector<Float4> shadowed_;   // [shadowed lights][materials][kNormalCount]
};

// Converts sRGB bytes to linear light 0..1, and back: rounded to 4,096 steps, clamped.
class ColourTable {
  public:
    ColourTable();
    // Red in the lowest byte.
    Float4 linear(std::uint32_t srgb) const {
        return Float4{linear_[srgb & 255], linear_[srgb >> 8 & 255], linear_[srgb >> 16 & 255], 0};
    }
    // Opaque, packed as pack_rgba does.
    std::uint32_t pack_srgb(Float4 linear) const {
        constexpr Float4 kOne{1, 1, 1, 1};
        const Float4 clamped = linear < kOne ? linear : kOne;
        const Int4 step = __builtin_convertvector(clamped * kSteps + 0.5F, Int4);
        return std::uint32_t{srgb_[index(step[0])]} | std::uint32_t{srgb_[index(step[1])]} << 8 |
               std::uint32_t{srgb_[index(step[2])]} << 16 | 0xFF000000U;
    }

  private:
    static constexpr float kSteps = 4095;
    static std::size_t index(std::int32_t step) { return static_cast<std::size_t>(step); }
    std::array<float, 256> linear_;
    std::array<std::uint8_t, 4096> srgb_{};
};

} // namespace pbm
