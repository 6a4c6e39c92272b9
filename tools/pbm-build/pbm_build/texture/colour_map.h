// Palettes of solid textures: colour stops by name or from the user's text. Feeds BVG.md 3.8.
#pragma once

#include "pbm_format/model/model.h"
#include "system/error.h"

#include <array>
#include <span>
#include <string_view>
#include <vector>

namespace pbm::build {

struct ColourStop {
    double position = 0; // 0..1
    Rgb8 colour{};       // sRGB
};

// Names of the colour maps of a kind, the default first. Marble: 0 is the core of a vein, 1 clear stone. Wood: 0 is
// early wood, 1 late wood.
std::vector<std::string_view> colour_map_names(TextureKind kind);

// Stops of a named map (empty: the default), or those of a text like "0:#30251c,0.6:#a67c52,1:#d9b98c": 1 to 64 stops,
// positions ascending within 0..1.
//
// errors  usage  not a name or a list of stops
Result<std::vector<ColourStop>> find_colour_stops(TextureKind kind, std::string_view text);

// 256 colours, entry i for position i / 255: interpolated between stops in linear light (the table of BVG.md 6.3.3),
// constant before the first and behind the last stop.
std::array<Rgb8, 256> make_palette(std::span<const ColourStop> stops);

} // namespace pbm::build
