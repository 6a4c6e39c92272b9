// Computes the colours of the points of a level that lies in memory as a whole: reads their attributes for a
// PointShader.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/drawn_level.h"
#include "pbm_render/shading/point_shader.h"

#include <glm/vec2.hpp>

#include <cstddef>
#include <cstdint>

namespace pbm {

class LevelShader {
  public:
    // All arguments must outlive the shader. `shader` was made for `model` and `appearance`, `points` for this level.
    LevelShader(const Model &model, int level, const DrawnLevel &points, const Appearance &appearance,
                const PointShader &shader);

    // Returns the opaque sRGB colour, as pack_rgba, of point `index` of `points` where `pixel` shows it at `depth`
    // (grid edges).
    std::uint32_t shade(std::size_t index, glm::vec2 pixel, float depth) const {
        return is_special_ ? shade_as<true>(index, pixel, depth) : shade_as<false>(index, pixel, depth);
    }

  private:
    template <bool kSpecial> std::uint32_t shade_as(std::size_t index, glm::vec2 pixel, float depth) const;
    std::uint32_t colour(std::size_t index) const;
    float lit_fraction(std::size_t light, std::size_t index) const;

    const AttributeSet &set_;
    const DrawnLevel &drawn_;
    const PointView &points_;
    const int level_;
    const std::array<ShadowSource, kMaxLights> &shadows_;
    const PointShader &shader_;
    const bool is_special_;             // PointShader::is_special
    const std::uint8_t *const indices_; // into the palette; null: the colour has another source
};

extern template std::uint32_t LevelShader::shade_as<false>(std::size_t, glm::vec2, float) const;
extern template std::uint32_t LevelShader::shade_as<true>(std::size_t, glm::vec2, float) const;

} // namespace pbm
