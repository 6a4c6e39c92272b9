#include "viewer/options/option_values.h"

#include "pbm_render/appearance/field_choice.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

namespace pbm {
namespace {

// `count` finite numbers with one of `separators` between them.
std::optional<std::vector<double>> parse_numbers(std::string_view text, std::string_view separators,
                                                 std::size_t count) {
    std::vector<double> numbers(count);
    const char *at = text.data();
    const char *const end = at + text.size();
    for (double &number : numbers) {
        if (&number != &numbers.front() && (at == end || separators.find(*at++) == std::string_view::npos))
            return std::nullopt;
        const auto [after, error] = std::from_chars(at, end, number);
        if (error != std::errc() || !std::isfinite(number))
            return std::nullopt;
        at = after;
    }
    return at == end ? std::optional(numbers) : std::nullopt;
}

} // namespace

Result<glm::ivec2> parse_resolution(const std::string &text) {
    const auto numbers = parse_numbers(text, ",x", 2);
    const auto is_edge = [](double n) { return n >= 1 && n <= kMaxPictureEdge && n == std::floor(n); };
    if (!numbers || !is_edge((*numbers)[0]) || !is_edge((*numbers)[1]))
        return usage_error("'" + text + "' is no resolution; write 1280,720 or 1280x720, at most " +
                           std::to_string(kMaxPictureEdge) + " each");
    return glm::ivec2((*numbers)[0], (*numbers)[1]);
}

Result<glm::dvec3> parse_vector(const std::string &text) {
    const auto numbers = parse_numbers(text, ",", 3);
    if (!numbers)
        return usage_error("'" + text + "' is no vector; write three numbers like 0,0.5,-2");
    return glm::dvec3((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

Result<ClipPlane> parse_clip_plane(const std::string &text) {
    const auto n = parse_numbers(text, ",", 6);
    if (!n || ((*n)[3] == 0 && (*n)[4] == 0 && (*n)[5] == 0))
        return usage_error(
            "'" + text +
            "' is no plane; write six numbers like 0,0.5,0,0,-1,0: a point of it, and the direction in which the "
            "model is kept");
    return ClipPlane{{(*n)[0], (*n)[1], (*n)[2]}, {(*n)[3], (*n)[4], (*n)[5]}};
}

Result<ClipBox> parse_clip_box(const std::string &text) {
    const auto n = parse_numbers(text, ",", 6);
    if (!n)
        return usage_error("'" + text + "' is no box; write six numbers like 0,0,0,1,1,2: two opposite corners");
    const glm::dvec3 a((*n)[0], (*n)[1], (*n)[2]), b((*n)[3], (*n)[4], (*n)[5]);
    return ClipBox{glm::min(a, b), glm::max(a, b)};
}

Status parse_background(const std::string &text, RenderOptions &options) {
    const auto one = parse_numbers(text, ",", 3), two = parse_numbers(text, ",", 6);
    const std::vector<double> numbers = one.value_or(two.value_or(std::vector<double>()));
    if (numbers.empty() || std::any_of(numbers.begin(), numbers.end(), [](double n) { return n < 0 || n > 1; }))
        return usage_error("'" + text +
                           "' is no colour; write three numbers from 0 to 1 like 0.2,0.2,0.2, or six: at the top "
                           "and at the bottom");
    const auto colour = [&](std::size_t first) {
        Rgba8 made{0, 0, 0, 255};
        for (std::size_t i = 0; i < 3; ++i)
            made[i] = static_cast<std::uint8_t>(std::lround(numbers[first + i] * 255));
        return made;
    };
    options.background = colour(0);
    options.background_below = two ? std::optional(colour(3)) : std::nullopt;
    return {};
}

Result<Headlight> parse_headlight(const std::string &text) {
    const auto numbers = parse_numbers(text, ",", 2);
    if (!numbers || std::abs((*numbers)[0]) > 180 || std::abs((*numbers)[1]) > 90)
        return usage_error("'" + text + "' is no headlight; write degrees to the right and up like 0,0 or -60,20");
    return Headlight{(*numbers)[0], (*numbers)[1]};
}

namespace {

struct NamedMap {
    std::string_view name;
    ColourMap map;
};
constexpr std::array kColourMaps{NamedMap{"viridis", ColourMap::viridis}, NamedMap{"grey", ColourMap::grey},
                                 NamedMap{"classes", ColourMap::classes}};

} // namespace

// From the end: a field's name may have commas.
Result<ColourBy> parse_colour_by(const std::string &text) {
    ColourBy by{.field = text, .choice = {}};
    const auto last_part = [&] {
        const std::size_t comma = by.field.rfind(',');
        return comma == std::string::npos ? std::string() : by.field.substr(comma + 1);
    };
    const auto drop_last = [&] { by.field.resize(by.field.rfind(',')); };
    for (const NamedMap &map : kColourMaps)
        if (last_part() == map.name) {
            by.choice.map = map.map;
            drop_last();
            break;
        }
    const auto as_number = [&] { return parse_numbers(last_part(), ",", 1); };
    if (const auto most = as_number()) {
        drop_last();
        const auto least = as_number();
        if (!least || !((*least)[0] < (*most)[0]))
            return usage_error("'" + text +
                               "' has no range; write two numbers, the smaller one first, like intensity,0,255");
        drop_last();
        by.choice.range = {(*least)[0], (*most)[0]};
    }
    if (by.field.empty())
        return usage_error("'" + text + "' names no field; write one like intensity or intensity,0,255,grey");
    if (by.choice.range && by.choice.map == ColourMap::classes)
        return usage_error("the colour map 'classes' has no range: each label has its colour");
    return by;
}

std::string colour_by_text(const ColourBy &by) {
    std::string text = by.field;
    const auto append = [&](std::string_view part) { (text += ',') += part; };
    if (by.choice.range)
        for (const double end : *by.choice.range)
            append(to_string(Value(end)));
    for (const NamedMap &map : kColourMaps)
        if (by.choice.map == map.map)
            append(map.name);
    return text;
}

std::vector<std::string> fields_to_keep(const LookOptions &look) {
    std::vector<std::string> fields;
    if (look.colour_by && !look.colour_by->if_there)
        fields.push_back(field_to_keep(look.colour_by->field));
    if (!look.classes.draws_all() && !look.classes.if_there)
        fields.push_back(field_to_keep("class"));
    std::sort(fields.begin(), fields.end());
    fields.erase(std::unique(fields.begin(), fields.end()), fields.end());
    std::erase(fields, ""); // what every model has
    return fields;
}

Result<double> parse_frame_rate(const std::string &text) {
    const auto numbers = parse_numbers(text, "", 1);
    if (!numbers || !((*numbers)[0] == 0 || ((*numbers)[0] >= 1 && (*numbers)[0] <= 240)))
        return usage_error("'" + text + "' is no frame rate; write 1 to 240, or 0 for any");
    return (*numbers)[0];
}

} // namespace pbm
