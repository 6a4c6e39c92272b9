#include "pbm_build/texture/colour_map.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_number.h"
#include "pbm_scan/text/words.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::size_t kMaxStops = 64;

struct ColourMap {
    TextureKind kind;
    std::string_view name, stops;
};

constexpr std::array kColourMaps{
    ColourMap{TextureKind::marble, "white", "0:#57504a,0.3:#8d867e,0.6:#c6bfb4,0.85:#e6e0d5,1:#f2ede3"},
    ColourMap{TextureKind::marble, "carrara", "0:#4d545c,0.3:#838b93,0.6:#bdc3c8,0.85:#dfe2e3,1:#eff0ef"},
    ColourMap{TextureKind::marble, "verde", "0:#dbe6d6,0.25:#8fb197,0.5:#4a7f66,0.75:#23533f,1:#143629"},
    ColourMap{TextureKind::marble, "nero", "0:#efe7d8,0.25:#a09a92,0.5:#57555a,0.75:#2b2a2f,1:#19181c"},
    ColourMap{TextureKind::marble, "rose", "0:#6e3a36,0.3:#a5675d,0.6:#cf9a8b,0.85:#e7c4b4,1:#f1dacd"},
    ColourMap{TextureKind::wood, "oak", "0:#d8b684,0.4:#bf935d,0.75:#94683a,1:#4b2f19"},
    ColourMap{TextureKind::wood, "walnut", "0:#91694a,0.4:#6f4b32,0.75:#482e1e,1:#22150e"},
    ColourMap{TextureKind::wood, "cherry", "0:#d9a274,0.4:#b8734a,0.75:#8c4a2d,1:#4a2216"},
};

// "0.5:#rrggbb"
std::optional<ColourStop> parse_stop(std::string_view text) {
    constexpr std::size_t kColourLength = 8; // ":#rrggbb"
    if (text.size() <= kColourLength || text.substr(text.size() - kColourLength, 2) != ":#")
        return std::nullopt;
    const auto position = parse_all<double>(text.substr(0, text.size() - kColourLength));
    const auto colour = parse_all<std::uint32_t>(text.substr(text.size() - 6), 16);
    if (!position || !colour || !(*position >= 0 && *position <= 1))
        return std::nullopt;
    return ColourStop{.position = *position,
                      .colour = {static_cast<std::uint8_t>(*colour >> 16), static_cast<std::uint8_t>(*colour >> 8),
                                 static_cast<std::uint8_t>(*colour)}};
}

Result<std::vector<ColourStop>> parse_stops(std::string_view text) {
    std::vector<ColourStop> stops;
    for (const std::string_view word : split(text)) {
        const auto stop = parse_stop(word);
        if (!stop)
            return usage_error(in_quotes(word) + " is no colour stop: write position:#rrggbb, position 0 to 1");
        if (!stops.empty() && stop->position <= stops.back().position)
            return usage_error("colour stop " + in_quotes(word) + " is not behind the one before it");
        if (stops.size() == kMaxStops)
            return usage_error("more than 64 colour stops");
        stops.push_back(*stop);
    }
    return stops;
}

} // namespace

std::vector<std::string_view> colour_map_names(TextureKind kind) {
    std::vector<std::string_view> names;
    for (const ColourMap &map : kColourMaps)
        if (map.kind == kind)
            names.push_back(map.name);
    return names;
}

Result<std::vector<ColourStop>> find_colour_stops(TextureKind kind, std::string_view text) {
    for (const ColourMap &map : kColourMaps)
        if (map.kind == kind && (text.empty() || text == map.name))
            return parse_stops(map.stops);
    if (text.find_first_of(":,#") == std::string_view::npos)
        return usage_error("no colour map " + in_quotes(text) + ": there are " + joined(colour_map_names(kind)) +
                           ", or colour stops like 0:#30251c,1:#d9b98c");
    return parse_stops(text);
}

std::array<Rgb8, 256> make_palette(std::span<const ColourStop> stops) {
    assert(!stops.empty());
    const std::span<const std::uint16_t> linear = linear_table();
    std::array<Rgb8, 256> palette{};
    for (std::size_t i = 0; i < palette.size(); ++i) {
        const double position = static_cast<double>(i) / 255;
        const auto behind = std::find_if(stops.begin(), stops.end(),
                                         [position](const ColourStop &stop) { return stop.position > position; });
        if (behind == stops.begin() || behind == stops.end()) {
            palette[i] = behind == stops.begin() ? stops.front().colour : stops.back().colour;
            continue;
        }
        const ColourStop &low = behind[-1], &high = *behind;
        const double share = (position - low.position) / (high.position - low.position);
        for (std::size_t channel = 0; channel < 3; ++channel) {
            const double from = linear[low.colour[channel]], to = linear[high.colour[channel]];
            palette[i][channel] = linear_to_srgb(static_cast<std::uint32_t>(from + share * (to - from) + 0.5));
        }
    }
    return palette;
}

} // namespace pbm::build
