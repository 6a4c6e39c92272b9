// Colours of points by one of the file's fields: a colour map takes the place of the solid texture's palette. BVG.md 17
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace pbm {

// viridis: dark violet, green, yellow, as bright as the value is large, also for those who see few colours; grey; and
// classes: a colour for each label, those of LAS as they are usual on maps.
// Based on: Smith, van der Walt. A Better Default Colormap for Matplotlib. 2015 (viridis)
enum class ColourMap : std::uint8_t { viridis, grey, classes };

struct FieldColours {
    std::size_t field = 0; // of the file
    ColourMap map = ColourMap::viridis;
    // Values with the first and the last colour; unused by `classes`. Equal: the sample has no other.
    double least = 0, most = 1;
    std::array<Rgb8, 256> palette{};   // index 0: points without a value
    std::vector<std::uint8_t> indices; // [Field::max_stored() + 1]: into the palette
    std::vector<std::uint32_t> labels; // stored values to explain, of `classes`
};

// What the user asked for; what is absent follows from the field and its values.
struct ColourChoice {
    std::optional<std::array<double, 2>> range; // least < most
    std::optional<ColourMap> map;
    bool operator==(const ColourChoice &) const = default;
};

// `sample`: stored values of some points of the model. Labels (fields with the majority as average) get the map
// `classes`, others viridis. The range leaves out a hundredth of the sample's values at each end, as a few far ones
// would leave one colour to all others.
FieldColours field_colours(std::size_t field, const Field &description, const ColourChoice &choice, ByteView sample);

// The parameters with which a renderer draws the points in the colours of a field: the column of texture values holds
// indices of its palette.
ModelParameters with_field_colours(ModelParameters parameters, const FieldColours &colours);

// Indices of a column of stored values.
void index_field(const FieldColours &colours, const Field &description, ByteView stored,
                 std::vector<std::uint8_t> &indices);

// Replaces the texture values of a whole model whose fields are loaded.
void colour_by_field(Model &model, const FieldColours &colours);

// "ground", "building", ..: of the classes of LAS; empty for others. LAS 1.4 R15, table 17
std::string_view class_name(std::uint32_t number);

} // namespace pbm
