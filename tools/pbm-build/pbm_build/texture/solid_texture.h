// Solid textures: marble and wood, evaluated at build time as one byte per point, an index into the palette.
// BVG.md 3.8 and 6.5; formulas in docs/reference/solid-textures.md.
// Based on: Perlin. An Image Synthesizer. 1985; Peachey. Solid Texturing of Complex Surfaces. 1985
#pragma once

#include "pbm_format/model/model.h"
#include "system/error.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace pbm::build {

// Texture space: (position - minimum corner of the grid) / edge of the grid x scale, with the axes (u, v, up) of
// GroundPlane. So a texture looks the same for any size, unit and depth; detail finer than two voxels is omitted. Veins
// and rings are about one unit apart.
inline constexpr float kMinTextureScale = 0.01F, kMaxTextureScale = 1000;
inline constexpr float kMaxTurbulence = 100;
inline constexpr float kDefaultTurbulence = 1; // 0: straight veins, round rings

// "marble", "wood"; nothing for other words.
std::optional<TextureKind> texture_kind(std::string_view name);

struct TextureOptions {
    TextureKind kind = TextureKind::marble;
    std::string colours{}; // name of a colour map or stops (colour_map.h); empty: the kind's default
    std::uint32_t seed = 0;
    std::optional<float> scale{};          // kMinTextureScale..kMaxTextureScale; default: marble 5, wood 30
    float turbulence = kDefaultTurbulence; // 0..kMaxTurbulence
};

// errors  usage  a number out of its range or not finite; colours as find_colour_stops
Result<SolidTexture> make_texture(const TextureOptions &options);

// values[i]: the texture at the centre of the finest voxel codes[i]. The same for any number of threads. Clamps numbers
// of `texture` to the ranges above.
void evaluate_texture(const SolidTexture &texture, const Grid &grid, std::span<const MortonCode> codes,
                      std::span<std::uint8_t> values, int threads);

// The raster of the ground plane: [size][size], 1 channel, as ModelImages::ground_texture. Marble is a slice through
// the solid. Wood is a floor of boards along u, each cut from another place of the solid, with dark seams. Ignores
// `ground.texture`.
Image evaluate_ground_texture(const SolidTexture &texture, const Grid &grid, const GroundPlane &ground,
                              std::uint32_t size, int threads);

} // namespace pbm::build
