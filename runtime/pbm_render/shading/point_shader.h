// Computes the colour of a point in a pixel: Phong reflection times the point's colour, blended with the panorama that
// its normal mirrors. Holds the lights, materials and view of one frame.
// Based on: dissertation sections 4.6 and 5.8
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/camera/projection.h"
#include "pbm_render/surroundings/frame_surroundings.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>
#include <span>
#include <vector>

namespace pbm {

// Attributes of a point that shading needs.
struct PointLook {
    std::uint32_t colour;   // sRGB, red in the lowest byte; unused if the source is the material
    std::uint16_t normal;   // index | kTwoSidedBit
    std::uint16_t material; // index
};

class PointShader {
  public:
    // `projection` maps the unit grid to the screen; `surroundings` are those of the frame, or null. All must
    // outlive the shader. `shades`: shade() will be called; else the shader has tables only for what it needs itself.
    PointShader(const ModelParameters &parameters, const Appearance &appearance, const Projection &projection,
                const FrameSurroundings *surroundings, const RenderOptions &options, bool shades);

    ColourSource colour_source() const { return source_; }
    // Format of the colour stream if it is used, else none.
    ColourFormat point_colours() const { return point_colours_; }
    // sRGB, red in the lowest byte, by value of the solid texture.
    const std::array<std::uint32_t, 256> &palette() const { return palette_; }
    // Whether there are point or spot lights: the pixels of one point may then differ.
    bool is_positional() const { return positional_; }
    // Whether there are point or spot lights, or mirroring materials. Selects the template argument of shade().
    bool is_special() const { return positional_ || mirrors(); }
    // Whether materials mirror the panorama.
    bool mirrors() const { return !mirrored_.empty(); }

    // Lights whose shadow streams are used: those with lower indices.
    std::size_t shadowed() const { return shadowed_; }

    // Returns the opaque sRGB colour, as pack_rgba. `pixel`: in the coordinates of Projection. `lit(l)`: the lit
    // fraction 0..1 of light l, called for lights with a shadow stream. `positional()`: what point and spot lights add
    // to the reflection of a white point: red, green, blue, 0; called if is_positional().
    template <bool kSpecial, class Lit, class Positional>
    std::uint32_t shade(PointLook point, glm::vec2 pixel, Lit &&lit, Positional &&positional) const {
        const std::size_t normal = visible_normal(point, pixel);
        if (has_shaded_normals())
            return shaded(point.material, normal);
        Float4 light = table_->unshadowed(point.material, normal);
        for (const std::size_t l : shadowed_directional_)
            light += table_->shadowed(l, point.material, normal) * lit(l);
        if constexpr (kSpecial) {
            if (positional_)
                light += positional();
            return colours_.pack_srgb(mirror(own_colour(point), light, point.material, normal));
        }
        return colours_.pack_srgb(own_colour(point) * light);
    }

    // Whether colours depend on nothing but material and normal: shaded() is then what shade() returns.
    bool has_shaded_normals() const { return !shaded_normals_.empty(); }
    std::uint32_t shaded(std::size_t material, std::size_t normal) const {
        return shaded_normals_[material * kNormalCount + normal];
    }
    // What materials mirror of the panorama, linear. Expects mirrors().
    Float4 mirrored(std::size_t normal) const { return mirrored_[normal]; }
    // Whether some material tints it.
    bool tints() const { return tints_; }
    // The same in the colour of a point, as its material tints it. `srgb`: red in the lowest byte.
    Float4 tinted(Float4 mirrored, std::uint32_t srgb, std::size_t material) const {
        return tinted(mirrored, colours_.linear(srgb), material);
    }

    // What point and spot lights add to the reflection of one white point; shade_points does so for many. `depth`: grid
    // edges.
    template <class Lit> Float4 positional(PointLook point, glm::vec2 pixel, float depth, Lit &&lit) const {
        const std::size_t normal = visible_normal(point, pixel);
        Float4 light{};
        for (std::size_t l = 0; l < appearance_.lights.size(); ++l)
            if (appearance_.lights[l].kind != LightKind::directional)
                light +=
                    reflect(appearance_.lights[l], point.material, normal, pixel, depth) * (l < shadowed_ ? lit(l) : 1);
        return light;
    }

    // Index of the point's normal; where its back is seen, of the opposite one.
    std::size_t visible_normal(PointLook point, glm::vec2 pixel) const {
        const std::size_t normal = point.normal & kNormalIndexMask;
        if ((point.normal & kTwoSidedBit) != 0)
            return visible_side(normal, pixel, 0);
        return projection_.shows_backs ? visible_side(normal, pixel, kFacingSlack) : normal;
    }

  private:
    Float4 own_colour(PointLook point) const {
        return source_ == ColourSource::material ? material_colours_[point.material] : colours_.linear(point.colour);
    }
    // `colour`: linear.
    Float4 tinted(Float4 mirrored, Float4 colour, std::size_t material) const {
        const float tint = static_cast<float>(appearance_.materials[material].tint) / 255;
        return mirrored * (1 - tint + tint * colour);
    }
    Float4 mirror(Float4 colour, Float4 light, std::size_t material, std::size_t normal) const;
    std::size_t visible_side(std::size_t normal, glm::vec2 pixel, float beyond) const;
    Float4 reflect(const Light &light, std::size_t material, std::size_t normal, glm::vec2 pixel, float depth) const;

    const ModelParameters &parameters_;
    const Appearance &appearance_;
    const Projection &projection_;
    const ColourSource source_;
    const ColourFormat point_colours_;
    const std::size_t shadowed_; // lights whose shadow streams are used
    const std::span<const SplatNormal> normals_;
    const glm::vec3 first_ray_, ray_right_, ray_down_; // of pixel (0, 0); steps to the next pixel
    std::optional<ShadeTable> table_;
    ColourTable colours_;
    std::array<Float4, kMaxMaterials> material_colours_{}; // linear
    std::array<std::uint32_t, 256> palette_{};
    std::vector<Float4> mirrored_;                  // [kNormalCount], linear; empty: nothing mirrors
    std::vector<std::size_t> shadowed_directional_; // directional lights whose shadow streams are used
    bool positional_ = false, tints_ = false;
    // [materials][kNormalCount] as pack_rgba if a point's colour depends on nothing else; otherwise empty.
    std::vector<std::uint32_t> shaded_normals_;
};

} // namespace pbm
