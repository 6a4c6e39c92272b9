#include "pbm_render/shading/level_shader.h"

namespace pbm {

LevelShader::LevelShader(const Model &model, int level, const DrawnLevel &points, const Appearance &appearance,
                         const PointShader &shader)
    : set_(model.parameters.attributes), drawn_(points), points_(points.values()), level_(level),
      shadows_(appearance.shadows), shader_(shader), is_special_(shader.is_special()),
      indices_(shader.colour_source() == ColourSource::texture ? points_.values(*palette_stream(set_)).data()
                                                               : nullptr) {}

std::uint32_t LevelShader::colour(std::size_t index) const {
    if (indices_ != nullptr)
        return shader_.palette()[indices_[index]];
    return pack_rgb(point_colour(points_.colours, index, shader_.point_colours()));
}

float LevelShader::lit_fraction(std::size_t light, std::size_t index) const {
    const auto level = static_cast<std::size_t>(level_);
    if (const ShadowSource &source = shadows_[light]; !source.of_file)
        return source.fresh ? static_cast<float>(source.fresh->levels[level][drawn_.origin(index)]) / 255 : 1;
    const int bits = set_.shadow_bits[light][level];
    return static_cast<float>(points_.shadows[light][index]) / static_cast<float>((1 << bits) - 1);
}

template <bool kSpecial> std::uint32_t LevelShader::shade_as(std::size_t index, glm::vec2 pixel, float depth) const {
    const PointLook look{.colour = colour(index),
                         .normal = points_.normals[index],
                         .material = set_.material ? std::uint16_t{points_.materials[index]} : std::uint16_t{0}};
    const auto lit = [&](std::size_t light) { return lit_fraction(light, index); };
    return shader_.shade<kSpecial>(look, pixel, lit, [&] { return shader_.positional(look, pixel, depth, lit); });
}

template std::uint32_t LevelShader::shade_as<false>(std::size_t, glm::vec2, float) const;
template std::uint32_t LevelShader::shade_as<true>(std::size_t, glm::vec2, float) const;

} // namespace pbm
