#include "pbm_render/appearance/field_colours.h"

#include <algorithm>
#include <cmath>

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

struct LasClass {
    std::string_view name;
    Rgb8 colour;
};
constexpr std::array kLasClasses{LasClass{"never classified", {190, 190, 190}},
                                 LasClass{"unclassified", {160, 160, 160}},
                                 LasClass{"ground", {166, 118, 70}},
                                 LasClass{"low vegetation", {170, 214, 120}},
                                 LasClass{"medium vegetation", {96, 176, 76}},
                                 LasClass{"high vegetation", {32, 122, 48}},
                                 LasClass{"building", {222, 92, 64}},
                                 LasClass{"low noise", {255, 0, 255}},
                                 LasClass{"key point", {240, 200, 60}},
                                 LasClass{"water", {64, 132, 222}},
                                 LasClass{"rail", {120, 90, 150}},
                                 LasClass{"road surface", {96, 96, 110}},
                                 LasClass{"overlap", {210, 190, 160}},
                                 LasClass{"wire guard", {250, 230, 120}},
                                 LasClass{"wire conductor", {250, 240, 40}},
                                 LasClass{"transmission tower", {150, 60, 160}},
                                 LasClass{"wire connector", {200, 170, 40}},
                                 LasClass{"bridge deck", {180, 130, 130}},
                                 LasClass{"high noise", {255, 80, 200}}};

// Of a label: those of LAS, then hues a golden angle apart.
Rgb8 class_colour(std::uint32_t label) {
    if (label < kLasClasses.size())
        return kLasClasses[label].colour;
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

// The range of most values.
std::array<double, 2> range_of(const Field &field, std::span<const std::uint32_t> sorted) {
    if (sorted.empty())
        return {field.value(1), field.value(field.max_stored())};
    const std::size_t end = sorted.size() / 100;
    const double least = field.value(sorted[end]), most = field.value(sorted[sorted.size() - 1 - end]);
    return most > least ? std::array{least, most} : std::array{field.value(sorted.front()), field.value(sorted.back())};
}

} // namespace

std::string_view class_name(std::uint32_t number) {
    return number < kLasClasses.size() ? kLasClasses[number].name : std::string_view();
}

FieldColours field_colours(std::size_t field, const Field &description, const ColourChoice &choice, ByteView sample) {
    const bool has_labels = description.average == FieldAverage::majority && !choice.range;
    FieldColours colours{.field = field,
                         .map = choice.map.value_or(has_labels ? ColourMap::classes : ColourMap::viridis),
                         .palette = {},
                         .indices = std::vector<std::uint8_t>(description.max_stored() + 1),
                         .labels = {}};
    std::vector<std::uint32_t> values = sorted_values(description, sample);
    const auto [least, most] = choice.range.value_or(range_of(description, values));
    colours.least = least;
    colours.most = most;
    colours.palette[0] = kNoValue;
    for (std::size_t i = 1; i < colours.palette.size(); ++i) {
        const double part = static_cast<double>(i - 1) / 254;
        colours.palette[i] = colours.map == ColourMap::viridis ? viridis(part)
                             : colours.map == ColourMap::grey  ? Rgb8{to_byte(part), to_byte(part), to_byte(part)}
                                                               : class_colour(static_cast<std::uint32_t>(i - 1));
    }
    for (std::uint32_t stored = 1; stored < colours.indices.size(); ++stored) {
        const double value = description.value(stored);
        const double at = colours.map == ColourMap::classes ? std::fmod(std::fmod(std::round(value), 255) + 255, 255)
                          : least == most                   ? value < least  ? 0
                                                              : value > most ? 254
                                                                             : 127
                                          : 254 * std::clamp((value - least) / (most - least), 0.0, 1.0);
        colours.indices[stored] = static_cast<std::uint8_t>(1 + std::lround(at));
    }
    if (colours.map == ColourMap::classes) {
        values.erase(std::unique(values.begin(), values.end()), values.end());
        colours.labels = std::move(values);
    }
    return colours;
}

ModelParameters with_field_colours(ModelParameters parameters, const FieldColours &colours) {
    parameters.attributes.texture = true;
    parameters.texture.resize(1);
    parameters.texture.front().palette = colours.palette;
    return parameters;
}

void index_field(const FieldColours &colours, const Field &description, ByteView stored,
                 std::vector<std::uint8_t> &indices) {
    indices.resize(stored.size() / description.bytes);
    for (std::size_t i = 0; i < indices.size(); ++i)
        indices[i] = colours.indices[stored_value(stored, i, description.bytes)];
}

void colour_by_field(Model &model, const FieldColours &colours) {
    for (Level &level : model.levels)
        index_field(colours, model.parameters.fields[colours.field], level.fields[colours.field],
                    level.points.textures);
    model.parameters = with_field_colours(std::move(model.parameters), colours);
}

} // namespace pbm
