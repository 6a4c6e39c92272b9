#include "pbm_render/appearance/field_colours.h"

#include "pbm_format/model/intensity_stretch.h"
#include "pbm_format/model/las_classes.h"
#include "pbm_format/model/normal.h"
#include "pbm_format/model/octree.h"
#include "system/letters.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace pbm {
namespace {

constexpr Rgb8 kNoValue{96, 96, 96};

std::uint8_t to_byte(double part) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(part, 0.0, 1.0))); }

// The table of viridis as a polynomial of degree 6: at most 4 of 255 away from it.
Rgb8 viridis(double t) {
    constexpr std::array<std::array<double, 3>, 7> kTerms{{{0.277727, 0.005407, 0.334100},
                                                           {0.105093, 1.404614, 1.384590},
                                                           {-0.330862, 0.214848, 0.095095},
                                                           {-4.634230, -5.799101, -19.332441},
                                                           {6.228270, 14.179933, 56.690553},
                                                           {4.776385, -13.745145, -65.353033},
                                                           {-5.435456, 4.645853, 26.312435}}};
    Rgb8 colour{};
    for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (std::size_t term = kTerms.size(); term-- > 0;)
            sum = sum * t + kTerms[term][c];
        colour[c] = to_byte(sum);
    }
    return colour;
}

constexpr std::array<Rgb8, kLasClasses> kClassColours{{{190, 190, 190},
                                                       {160, 160, 160},
                                                       {166, 118, 70},
                                                       {170, 214, 120},
                                                       {96, 176, 76},
                                                       {32, 122, 48},
                                                       {222, 92, 64},
                                                       {255, 0, 255},
                                                       {240, 200, 60},
                                                       {64, 132, 222},
                                                       {120, 90, 150},
                                                       {96, 96, 110},
                                                       {210, 190, 160},
                                                       {250, 230, 120},
                                                       {250, 240, 40},
                                                       {150, 60, 160},
                                                       {200, 170, 40},
                                                       {180, 130, 130},
                                                       {255, 80, 200}}};

// Of a label: those of LAS, then hues a golden angle apart.
Rgb8 class_colour(std::uint32_t label) {
    if (label < kClassColours.size())
        return kClassColours[label];
    const double hue = std::fmod(label * 0.618034, 1.0) * 6;
    Rgb8 colour{};
    for (std::size_t c = 0; c < 3; ++c) {
        const double from = std::fabs(std::fmod(hue + 4.0 * static_cast<double>(c), 6.0) - 3);
        colour[c] = to_byte(0.3 + 0.6 * std::clamp(from - 1, 0.0, 1.0));
    }
    return colour;
}

std::vector<std::uint32_t> sorted_values(const Field &field, ByteView sample) {
    std::vector<std::uint32_t> values;
    for (std::size_t i = 0; i < sample.size() / field.bytes; ++i)
        if (const std::uint32_t stored = stored_value(sample, i, field.bytes); stored != 0)
            values.push_back(stored);
    std::sort(values.begin(), values.end());
    return values;
}

// The range of most values, without `omitted` hundredths at each end.
std::array<double, 2> range_of(const Field &field, std::span<const std::uint32_t> sorted, std::size_t omitted) {
    if (sorted.empty())
        return {field.value(1), field.value(field.max_stored())};
    const std::size_t end = sorted.size() * omitted / 100;
    const double least = field.value(sorted[end]), most = field.value(sorted[sorted.size() - 1 - end]);
    return most > least ? std::array{least, most} : std::array{field.value(sorted.front()), field.value(sorted.back())};
}

// "intensity", "scalar_Intensity", "reflectance".
bool is_intensity(const std::string &name) {
    std::string text = name;
    for (char &letter : text)
        letter = lower_case(letter);
    return text.ends_with("intensity") || text.ends_with("reflectance");
}

Rgb8 colour_of(ColourMap map, std::size_t index) {
    const double part = static_cast<double>(index) / 254;
    switch (map) {
    case ColourMap::viridis: return viridis(part);
    case ColourMap::grey: return {to_byte(part), to_byte(part), to_byte(part)};
    default: return class_colour(static_cast<std::uint32_t>(index));
    }
}

// Place of a value in the map, 0..254.
double place_of(const FieldColours &colours, double value) {
    const auto [least, most] = std::array{colours.least, colours.most};
    if (colours.map == ColourMap::classes)
        return std::fmod(std::fmod(std::round(value), 255) + 255, 255);
    if (least == most)
        return value < least ? 0 : value > most ? 254 : 127;
    const double part = std::clamp((value - least) / (most - least), 0.0, 1.0);
    return 254 * (colours.gamma == 1 ? part : std::pow(part, colours.gamma));
}

} // namespace

FieldColours field_colours(std::size_t field, const Field &description, const ColourChoice &choice, ByteView sample) {
    const bool has_labels = description.average == FieldAverage::majority && !choice.range;
    const bool is_stretched = !has_labels && !choice.range && !choice.map && is_intensity(description.name);
    const ColourMap usual = has_labels ? ColourMap::classes : is_stretched ? ColourMap::grey : ColourMap::viridis;
    FieldColours colours{.field = field,
                         .map = choice.map.value_or(usual),
                         .palette = {},
                         .indices = std::vector<std::uint8_t>(description.max_stored() + 1),
                         .labels = {},
                         .description = description};
    std::vector<std::uint32_t> values = sorted_values(description, sample);
    const auto [least, most] =
        choice.range.value_or(range_of(description, values, is_stretched ? kOmittedIntensities : 1));
    colours.least = least;
    colours.most = most;
    if (is_stretched && !values.empty() && least < most)
        colours.gamma = intensity_gamma(least, description.value(values[values.size() / 2]), most);
    colours.palette[0] = kNoValue;
    for (std::size_t i = 1; i < colours.palette.size(); ++i)
        colours.palette[i] = colour_of(colours.map, i - 1);
    for (std::uint32_t stored = 1; stored < colours.indices.size(); ++stored)
        colours.indices[stored] =
            static_cast<std::uint8_t>(1 + std::lround(place_of(colours, description.value(stored))));
    if (colours.map == ColourMap::classes) {
        values.erase(std::unique(values.begin(), values.end()), values.end());
        colours.labels = std::move(values);
    }
    return colours;
}

Field height_field(const Grid &grid, std::size_t axis) {
    const double step = grid.edge() / 65535;
    return {.name = "height",
            .unit = grid.unit == Unit::unknown ? std::string() : std::string(to_string(grid.unit)),
            .offset = grid.origin[axis] + step / 2,
            .scale = step,
            .bytes = 2};
}

FieldColours height_colours(const Grid &grid, std::size_t axis, const ColourChoice &choice, ByteView sample) {
    FieldColours colours = field_colours(0, height_field(grid, axis), choice, sample);
    colours.basis = ColourBasis::height;
    colours.axis = axis;
    constexpr double kBegin = 0.3; // of viridis: the ground, most of many scans, is lighter than the background
    for (std::size_t i = 1; i < colours.palette.size() && !choice.map; ++i)
        colours.palette[i] = viridis(kBegin + (1 - kBegin) * static_cast<double>(i - 1) / 254);
    return colours;
}

ModelParameters with_field_colours(ModelParameters parameters, const FieldColours &colours) {
    const bool has_palette = colours.basis == ColourBasis::field || colours.basis == ColourBasis::height;
    parameters.attributes.texture = has_palette;
    parameters.texture.resize(has_palette ? 1 : 0);
    if (has_palette)
        parameters.texture.front().palette = colours.palette;
    else
        parameters.attributes.colour = colours.basis == ColourBasis::normal ? ColourFormat::rgb888 : ColourFormat::none;
    return parameters;
}

void index_field(const FieldColours &colours, const Field &description, ByteView stored,
                 std::vector<std::uint8_t> &indices) {
    indices.resize(stored.size() / description.bytes);
    for (std::size_t i = 0; i < indices.size(); ++i)
        indices[i] = colours.indices[stored_value(stored, i, description.bytes)];
}

void colour_normals(std::span<const std::uint16_t> normals, Bytes &colours) {
    colours.resize(3 * normals.size());
    for (std::size_t i = 0; i < normals.size(); ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
            colours[3 * i + axis] =
                to_byte((1 + static_cast<double>(normal_table()[normals[i] & kNormalIndexMask][axis])) / 2);
}

void colour_by_field(Model &model, const FieldColours &colours) {
    std::vector<MortonCode> codes{0};
    for (std::size_t l = 0; l < model.levels.size(); ++l) {
        Level &level = model.levels[l];
        PointAttributes &points = level.points;
        if (colours.basis == ColourBasis::field)
            index_field(colours, model.parameters.fields[colours.field], level.fields[colours.field], points.textures);
        else if (colours.basis == ColourBasis::normal)
            colour_normals(points.normals, points.colours);
        if (colours.basis == ColourBasis::normal)
            colour_normals(level.sides.values.normals, level.sides.values.colours);
        const auto colour_sides = [&] {
            level.sides.values.textures.clear();
            for (const std::uint32_t point : level.sides.points)
                level.sides.values.textures.insert(level.sides.values.textures.end(), 2, points.textures[point]);
        };
        if (colours.basis == ColourBasis::field)
            colour_sides();
        if (colours.basis != ColourBasis::height)
            continue;
        if (l > 0)
            if (auto children = expand_level(codes, level.masks, points.size()))
                codes = std::move(*children);
        points.textures.resize(points.size());
        for (std::size_t i = 0; i < codes.size(); ++i)
            points.textures[i] =
                colours.indices[stored_height(morton_decode(codes[i])[colours.axis], static_cast<int>(l))];
        colour_sides();
    }
    model.parameters = with_field_colours(std::move(model.parameters), colours);
}

} // namespace pbm
