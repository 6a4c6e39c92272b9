// Colours of points by one of the file's fields, or by what every model has: height, normal, material. A colour map
// takes the place of the solid texture's palette. BVG.md 17.
// Stability: experimental.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pbm {

// viridis: dark violet over green to yellow; brightness grows with the value, so that colour-blind readers can order
// values. grey: black to white. classes: one colour for each label; classes of LAS have their usual colours on maps.
// Based on: Smith, van der Walt. A Better Default Colormap for Matplotlib. 2015 (viridis)
enum class ColourMap : std::uint8_t { viridis, grey, classes };

// What gives points their colours: a field of the file; their place along an axis; red, green and blue for the parts of
// their normals along x, y and z; or their material alone.
enum class ColourBasis : std::uint8_t { field, height, normal, plain };

struct FieldColours {
    std::size_t field = 0; // of the file
    ColourMap map = ColourMap::viridis;
    // Values of the first and the last colour; unused by `classes`. They are equal if the sample has one value only.
    double least = 0, most = 1;
    std::array<Rgb8, 256> palette{};        // index 0: points without a value
    std::vector<std::uint8_t> indices;      // [Field::max_stored() + 1]: into the palette
    std::vector<std::uint32_t> labels;      // stored values that a legend explains; `classes` only
    ColourBasis basis = ColourBasis::field; // `map` and what follows it are of fields and heights
    std::size_t axis = 0;                   // of heights
    Field description{};                    // of the field, or of heights as a field of 16 bits
    // The map's place of a value is (part of the range)^gamma.
    double gamma = 1;
};

// The user's choice. Absent members follow from the field and its values.
struct ColourChoice {
    std::optional<std::array<double, 2>> range; // least < most
    std::optional<ColourMap> map;
    bool operator==(const ColourChoice &) const = default;
};

// `sample`: stored values of some points of the model. Labels (fields with the majority as average) get the map
// `classes`, others viridis. The range omits 1 % of the sample's values at each end: a few outliers would otherwise
// leave one colour for all other values. Intensities without a choice are grey, omit 2 % at each end, and have the
// gamma that makes their median a middle grey: most echoes are weak.
FieldColours field_colours(std::size_t field, const Field &description, const ColourChoice &choice, ByteView sample);

// Heights along an axis (0..2) as a field, whose stored values lie a 65,535th of the grid's edge apart.
Field height_field(const Grid &grid, std::size_t axis);
// Stored height of the points of `level` whose voxels have this coordinate.
constexpr std::uint32_t stored_height(std::uint32_t coordinate, int level) {
    return 1 + static_cast<std::uint32_t>((std::uint64_t{2} * coordinate + 1) * 65535 >> (level + 1));
}
// Unless the map is chosen, its darkest part is left out.
FieldColours height_colours(const Grid &grid, std::size_t axis, const ColourChoice &choice, ByteView sample);

// Returns parameters for a renderer that draws the points in these colours. It takes their texture values as indices of
// the palette, and their colours as those of their normals.
ModelParameters with_field_colours(ModelParameters parameters, const FieldColours &colours);

// Writes the palette index of each stored value in a column.
void index_field(const FieldColours &colours, const Field &description, ByteView stored,
                 std::vector<std::uint8_t> &indices);

// Writes the sRGB bytes of each normal.
void colour_normals(std::span<const std::uint16_t> normals, Bytes &colours);

// Replaces the texture values, or the colours, of a whole model whose fields are loaded.
void colour_by_field(Model &model, const FieldColours &colours);

} // namespace pbm
