#include "pbm_scan/conventions/reflectance.h"

#include "pbm_format/model/point_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace pbm::build {
namespace {

std::uint8_t share_to_byte(double share) { return static_cast<std::uint8_t>(std::floor(share * 255 + 0.5)); }

} // namespace

void set_reflectance(const Reflectance &reflectance, Material &material) {
    const double rough = reflectance.roughness;
    material.ks = static_cast<float>((1 - rough) * (0.1 * reflectance.specular + 0.6 * reflectance.metal));
    material.power = static_cast<float>(std::clamp(2 / std::max(1e-6, rough * rough * rough * rough) - 2, 1.0, 1024.0));
    material.environment = static_cast<float>(0.4 * reflectance.metal * (1 - rough));
    material.tint = reflectance.tints && material.environment > 0 ? 255 : 0;
}

Reflectance reflectance_of(const Material &material) {
    const double rough = std::pow(2 / (static_cast<double>(material.power) + 2), 0.25);
    return {.roughness = rough, .specular = std::min(static_cast<double>(material.ks) / (0.1 * (1 - rough)), 1.0)};
}

Reflectance reflectance_of(double specular, double gloss) {
    constexpr double kUsual = 0.04; // of what is no metal
    return {.roughness = 1 - gloss,
            .metal = std::clamp((specular - kUsual) / (1 - kUsual), 0.0, 1.0),
            .specular = std::min(specular / kUsual, 1.0)};
}

ReflectanceTexel texel_of(const Reflectance &reflectance) {
    const double smooth = 1 - reflectance.roughness;
    return {share_to_byte(reflectance.roughness), share_to_byte(smooth * reflectance.metal),
            share_to_byte(smooth * reflectance.specular)};
}

void set_part(ReflectancePart part, const std::array<float, 3> &colour, const std::array<std::uint8_t, 4> &from,
              std::array<std::uint8_t, 4> &texel) {
    const auto brightness = static_cast<std::uint8_t>((from[0] + from[1] + from[2]) / 3);
    const auto reflect = [&](double share) { texel[0] = share_to_byte(share * (texel[0] / 255.0)); };
    if (part == ReflectancePart::roughness_metal)
        texel = {texel[0], from[1], from[2], texel[3]};
    else if (part == ReflectancePart::roughness)
        texel[1] = brightness;
    else if (part == ReflectancePart::metal)
        texel[2] = brightness;
    else if (part == ReflectancePart::specular)
        reflect(from[3] / 255.0);
    else {
        const auto linear = [&](std::size_t c) { return colour[c] * static_cast<float>(linear_table()[from[c]]); };
        reflect(static_cast<double>(std::max({linear(0), linear(1), linear(2)})) / 65535);
    }
}

void settle_reflectance(Texture &image) {
    const Reflectance factors = image.use.factors;
    const bool has_specular = image.use.content == ImageContent::specular_roughness_metal;
    const std::span<const std::uint16_t> linear = linear_table();
    for (auto &texel : image.texels) {
        const double brightest = linear[std::max({texel[0], texel[1], texel[2]})] / 65535.0;
        const Reflectance here =
            image.use.content == ImageContent::specular_gloss
                ? reflectance_of(factors.specular * brightest, factors.roughness * (texel[3] / 255.0))
                : Reflectance{factors.roughness * (texel[1] / 255.0), factors.metal * (texel[2] / 255.0),
                              factors.specular * (has_specular ? texel[0] / 255.0 : 1)};
        const auto [roughness, metal, specular] = texel_of(here);
        texel = {roughness, metal, specular, 255};
    }
    image.use.content = ImageContent::reflectance;
    image.use.factors = {.tints = factors.tints};
}

void settle_emission(Texture &image) {
    const std::span<const std::uint16_t> linear = linear_table();
    std::array<std::array<std::uint8_t, 256>, 3> table{};
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < 256; ++i)
            table[c][i] = linear_to_srgb(static_cast<std::uint32_t>(
                std::min(image.use.light[c] * static_cast<float>(linear[i]) + 0.5F, 65535.0F)));
    for (auto &texel : image.texels)
        texel = {table[0][texel[0]], table[1][texel[1]], table[2][texel[2]], 255};
    image.use.light = {1, 1, 1};
}

void settle_occlusion(Texture &image) {
    for (auto &texel : image.texels)
        texel = {share_to_byte(static_cast<double>(image.use.strength) * (1 - texel[0] / 255.0)), 0, 0, 255};
    image.use.content = ImageContent::darkness;
    image.use.strength = 1;
}

} // namespace pbm::build
