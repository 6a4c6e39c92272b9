// What a point looks like in a pixel: Phong's reflection times its colour. One frame's lights, materials and view.
#pragma once

#include "pbm_render/normal_table.h"
#include "pbm_render/shade_table.h"
#include "pbm_render/transform_table.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace pbm {

// What a point says of itself.
struct PointLook {
    std::uint32_t colour;   // sRGB, red in the lowest byte; not used if PointShader::colour() is none
    std::uint16_t normal;   // index | kTwoSidedBit
    std::uint16_t material; // index
};

class PointShader {
  public:
    // `projection` takes the unit grid to the screen. All arguments must outlive the shader. `lights`: those of the
    // file or default_lights.
    PointShader(const ModelParameters &parameters, std::span<const Light> lights, const Projection &projection,
                bool point_colours);

    // How points say their colour; none if they have that of their material.
    ColourFormat colour() const { return colour_; }
    // Whether a light is nearer than infinitely far away: pixels of one point may then differ.
    bool is_positional() const { return positional_; }

    // sRGB, opaque, as pack_rgba. `pixel` as Projection has them; `depth` in grid edges. `lit(l)`: the lit fraction
    // 0..1 of light l, asked for lights that have a shadow stream.
    template <class Lit> std::uint32_t shade(PointLook point, glm::vec2 pixel, float depth, Lit &&lit) const {
        std::size_t normal = point.normal & (kNormalIndexMask | kTwoSidedBit);
        if ((normal & kTwoSidedBit) != 0)
            normal = side_seen(normal & kNormalIndexMask, pixel);
        if (!shaded_normals_.empty())
            return shaded_normals_[point.material * kNormalCount + normal];
        Float4 light = table_.unshadowed(point.material, normal);
        for (std::size_t l = 0; l < shadowed_; ++l)
            light += table_.shadowed(l, point.material, normal) * lit(l);
        if (positional_)
            for (std::size_t l = 0; l < lights_.size(); ++l)
                if (lights_[l].kind != LightKind::directional)
                    light += reflect(lights_[l], point.material, normal, pixel, depth) * (l < shadowed_ ? lit(l) : 1);
        return colours_.pack_srgb(
            (colour_ == ColourFormat::none ? material_colours_[point.material] : colours_.linear(point.colour)) *
            light);
    }

  private:
    std::size_t side_seen(std::size_t normal, glm::vec2 pixel) const;
    Float4 reflect(const Light &light, std::size_t material, std::size_t normal, glm::vec2 pixel, float depth) const;

    const ModelParameters &parameters_;
    std::span<const Light> lights_;
    const Projection &projection_;
    const ColourFormat colour_;
    const std::size_t shadowed_; // lights that have a shadow stream
    const std::span<const SplatNormal> normals_;
    const glm::vec3 first_ray_, ray_right_, ray_down_; // through pixel (0, 0), and from pixel to pixel
    ShadeTable table_;
    ColourTable colours_;
    std::array<Float4, kMaxMaterials> material_colours_{}; // linear
    bool positional_ = false;
    // [materials][kNormalCount] as pack_rgba, where points differ in nothing else; else empty.
    std::vector<std::uint32_t> shaded_normals_;
};

} // namespace pbm
