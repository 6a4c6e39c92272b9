// The looks of a model's points as numbers that can be blended.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/shadow_stream.h"
#include "pbm_render/fine/surface_buffer.h"

#include <array>

namespace pbm {

// Lit flags of hard shadows are stretched by this factor about 0.5 before blending and clamped to 0..1 afterwards. That
// keeps the shadow's edge in place and makes it as sharp as the flags allow.
// Based on: Green. Improved Alpha-Tested Magnification for Vector Textures and Special Effects. 2007
inline constexpr float kFlagContrast = 2;

class SurfacePoints {
  public:
    // `parameters` must outlive this object. `mirrors`: the frame has a panorama that materials reflect.
    SurfacePoints(const ModelParameters &parameters, const Appearance &appearance, const RenderOptions &options,
                  bool mirrors);

    std::size_t groups() const { return tints_ ? 3 : 1 + (has_phong_ || shadowed_ > 0) + (shadowed_ > 4); }
    // Whether the points have a tint.
    bool tints() const { return tints_; }
    // Whether points differ in ka, kd, ks and power.
    bool has_phong() const { return has_phong_; }
    // Number of lights whose shadow streams are used.
    std::size_t shadowed() const { return shadowed_; }

    // Reads all channels of point `i` of the run's chunk but normal and weight, in groups() groups; clamp lit fractions
    // to 0..1 after blending. Accesses stay in bounds if the bytes of a mapped chunk change.
    void read(const PointRun &run, std::size_t i, SurfacePoint &to) const {
        float *const channels = to.channels.data();
        const std::size_t material =
            run.chunk->materials.empty() ? 0 : std::min<std::size_t>(run.chunk->materials[i], last_material_);
        const Float4 colour = colour_of(run, i, material);
        channels[channel::kColour] = colour[0];
        channels[channel::kColour + 1] = colour[1];
        channels[channel::kColour + 2] = colour[2];
        channels[channel::kEnvironment] = environment_[material];
        if (groups() > 1)
            read_more(run, i, material, to);
    }

  private:
    // The channels of further groups. Not inline: most models have none.
    void read_more(const PointRun &run, std::size_t i, std::size_t material, SurfacePoint &to) const;
    Float4 colour_of(const PointRun &run, std::size_t i, std::size_t material) const {
        if (indices_ != nullptr)
            return palette_[(run.chunk->*indices_)[i]];
        if (colour_ == ColourFormat::none)
            return material_colours_[material];
        const Rgb8 c = point_colour(run.chunk->colours, i, colour_);
        return Float4{linear_[c[0]], linear_[c[1]], linear_[c[2]], 0};
    }

    ColourFormat colour_;
    ByteView PointView::*indices_; // into the palette; null: the colour has another source
    bool has_phong_, tints_;
    std::size_t shadowed_, last_material_;
    const AttributeSet &set_;
    const std::array<ShadowSource, kMaxLights> shadows_;
    std::array<float, 256> linear_;                           // by sRGB byte
    std::array<Float4, 256> palette_{};                       // linear
    std::array<Float4, kMaxMaterials> material_colours_{};    // linear
    std::array<Float4, kMaxMaterials> phong_{};               // ka, kd, ks, power
    std::array<float, kMaxMaterials> environment_{}, tint_{}; // tint: times the environment factor
};

} // namespace pbm
