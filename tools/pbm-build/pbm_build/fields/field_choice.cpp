#include "pbm_build/fields/field_choice.h"

#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"
#include "pbm_scan/text/words.h"
#include "system/utf8.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pbm::build {
namespace {

// What is known of the finite values of a field.
struct Values {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    std::uint64_t count = 0, outside = 0;
    bool are_whole = true;
};

Values survey(std::span<const FieldValue> values, const std::optional<std::array<double, 2>> &range) {
    Values found;
    for (const FieldValue &value : values) {
        const double number = value.number;
        if (!std::isfinite(number))
            continue;
        ++found.count;
        found.least = std::min(found.least, number);
        found.most = std::max(found.most, number);
        found.are_whole = found.are_whole && number == std::floor(number);
        found.outside += range && (number < (*range)[0] || number > (*range)[1]) ? 1 : 0;
    }
    if (range) {
        found.least = (*range)[0];
        found.most = (*range)[1];
        found.are_whole =
            found.are_whole && found.least == std::floor(found.least) && found.most == std::floor(found.most);
    }
    return found;
}

// A text that fits its place in the file, cut between characters.
std::string cut(std::string_view text, std::size_t bytes) {
    std::size_t end = 0;
    while (end < text.size()) {
        const std::size_t next = end + std::max<std::size_t>(utf8_character(text.substr(end)).bytes, 1);
        if (next > bytes)
            break;
        end = next;
    }
    return std::string(text.substr(0, end));
}

// Sets offset, scale and bytes.
void choose_steps(const Values &values, const std::optional<int> &bits, Field &field) {
    const double span = values.most - values.least;
    field.offset = values.least;
    const bool is_exact = values.are_whole && span < (bits == 8 ? 255 : 65535);
    field.bytes = static_cast<std::uint8_t>(bits ? *bits / 8 : is_exact && span < 255 ? 1 : 2);
    const double steps = static_cast<double>(field.max_stored()) - 1;
    field.scale = is_exact ? 1 : span / steps;
    if (!std::isnormal(field.scale))
        field.scale = 1;
}

Error no_such_field(const std::string &name, const Surface &surface) {
    std::vector<std::string> offered = surface.offered_fields;
    std::sort(offered.begin(), offered.end());
    offered.erase(std::unique(offered.begin(), offered.end()), offered.end());
    for (std::string &each : offered)
        each = printable(each);
    return usage_error("--field " + printable(name) + ": no input has such a measurement" +
                       (offered.empty() ? std::string(" or any other") : "; there is " + joined(offered, ", ")));
}

Error no_field(const std::string &text, const std::string &why) {
    return usage_error(printable_in_quotes(text) + ": " + why +
                       "; a field is NAME[=MIN,MAX][,mean|majority|max][,8|16]");
}

std::optional<FieldAverage> average_named(std::string_view name) {
    for (const FieldAverage average : {FieldAverage::mean, FieldAverage::majority, FieldAverage::maximum})
        if (name == to_string(average))
            return average;
    return {};
}

std::string note_of(const Field &field, const Values &values, std::uint64_t vertices) {
    int digits = 9; // more where they tell the ends apart
    while (digits < 17 && values.least != values.most &&
           formatted("%.*g", digits, values.least) == formatted("%.*g", digits, values.most))
        ++digits;
    std::string note =
        formatted("%.*g to %.*g%s%s, %d bits in steps of %.3g, ", digits, values.least, digits, values.most,
                  field.unit.empty() ? "" : " ", field.unit.c_str(), 8 * field.bytes, field.scale) +
        std::string(to_string(field.average));
    if (values.are_whole && field.scale != 1)
        note += "; whole numbers are rounded to these steps, a smaller range =MIN,MAX keeps them";
    if (values.outside != 0)
        note += "; " + counted(values.outside, "value") + " outside clamped";
    if (values.count != vertices)
        note += "; " + counted(vertices - values.count, "point") + " without a value";
    return note;
}

// The field that the values of a slot become.
Result<Field> choose_field(Surface &surface, std::size_t slot, const FieldRequest &request,
                           BuildStatistics &statistics) {
    Field field{.name = cut(request.name, kMaxFieldName),
                .unit = cut(surface.field_units[slot].value_or(""), kMaxFieldUnit)};
    const Values values = survey(surface.field_values[slot], request.range);
    if (values.count == 0)
        return bad_input("--field " + printable(field.name) + ": no point has a value; leave this option out");
    if (!std::isfinite(values.most - values.least))
        return bad_input("--field " + printable(field.name) +
                         ": its values are too far apart for a number; give a range, like =0,255");
    for (FieldValue &value : surface.field_values[slot])
        if (request.range)
            value.number = std::clamp(value.number, (*request.range)[0], (*request.range)[1]);
    choose_steps(values, request.bits, field);
    field.average = request.average.value_or(is_label(request.name) ? FieldAverage::majority : FieldAverage::mean);
    statistics.report("field " + printable(field.name), Fate::kept, note_of(field, values, surface.positions.size()));
    return field;
}

} // namespace

Result<FieldRequest> parse_field(const std::string &text) {
    FieldRequest request;
    const std::vector<std::string_view> parts = split(text);
    const std::size_t equals = parts.front().find('=');
    request.name = parts.front().substr(0, equals);
    if (request.name.empty())
        return no_field(text, "the name is missing");
    for (std::string_view rest = request.name; !rest.empty();) {
        const Utf8Character next = utf8_character(rest);
        if (next.bytes == 0 || is_control(next.code))
            return no_field(text, "the name is no text (UTF-8)");
        rest.remove_prefix(next.bytes);
    }
    std::size_t next = 1;
    if (equals != std::string::npos) {
        const auto least = parse_all<double>(parts.front().substr(equals + 1));
        const auto most = parts.size() > 1 ? parse_all<double>(parts[1]) : std::nullopt;
        if (!least || !most || !std::isfinite(*most - *least))
            return no_field(text, "a range is two numbers, =MIN,MAX");
        if (!(*least < *most))
            return no_field(text, "MIN must be below MAX");
        request.range = {*least, *most};
        next = 2;
    }
    for (; next < parts.size(); ++next) {
        const std::string_view part = parts[next];
        const std::optional<FieldAverage> average = average_named(part);
        if ((average && request.average) || (!average && request.bits && (part == "8" || part == "16")))
            return no_field(text, average ? "it has two averages" : "it has two numbers of bits");
        if (average)
            request.average = average;
        else if (part == "8" || part == "16")
            request.bits = part == "8" ? 8 : 16;
        else
            return no_field(text, printable_in_quotes(part) + " is no average and no number of bits");
    }
    return request;
}

std::vector<std::string> usual_fields(std::span<const std::string> dropped) {
    std::vector<std::string> fields;
    for (const std::string_view name : kUsualFields)
        if (std::none_of(dropped.begin(), dropped.end(), [&](const std::string &each) { return each == name; }))
            fields.emplace_back(name);
    return fields;
}

Result<std::vector<Field>> choose_fields(Surface &surface, std::span<const FieldRequest> requests,
                                         std::span<const std::string> usual, BuildStatistics &statistics) {
    std::vector<Field> fields;
    for (std::size_t i = 0; i < requests.size(); ++i) {
        const FieldRequest &request = requests[i];
        if (surface.field_values[i].empty())
            return no_such_field(request.name, surface);
        Result<Field> field = choose_field(surface, i, request, statistics);
        if (!field)
            return field.error();
        if (std::any_of(fields.begin(), fields.end(), [&](const Field &other) { return other.name == field->name; }))
            return usage_error("two fields have the same first " + std::to_string(kMaxFieldName) +
                               " bytes of their names, " + printable_in_quotes(field->name) +
                               "; leave one of these --field out");
        fields.push_back(std::move(*field));
    }
    for (std::size_t i = 0, slot = requests.size(); i < usual.size() && slot < kMaxFields; ++i, ++slot) {
        std::vector<FieldValue> values = std::exchange(surface.field_values[slot], {});
        const Values found = survey(values, {});
        if (found.least == found.most)
            statistics.report("field " + usual[i], Fate::converted, formatted("no field: all are %g", found.least));
        const bool is_taken =
            std::any_of(fields.begin(), fields.end(), [&](const Field &other) { return other.name == usual[i]; });
        if (!(found.least < found.most) || is_taken)
            continue;
        surface.field_values[fields.size()] = std::move(values);
        surface.field_units[fields.size()] = surface.field_units[slot];
        Result<Field> field = choose_field(surface, fields.size(),
                                           {.name = usual[i], .range = {}, .average = {}, .bits = {}}, statistics);
        if (!field)
            return field.error();
        fields.push_back(std::move(*field));
    }
    return fields;
}

std::vector<FieldSamples> field_samples(const Surface &surface, std::span<const Field> fields) {
    std::vector<FieldSamples> all(fields.size());
    for (std::size_t f = 0; f < fields.size(); ++f) {
        const Field &field = fields[f];
        const double last = static_cast<double>(field.max_stored()) - 1;
        all[f].average = field.average;
        all[f].values.reserve(surface.field_values[f].size());
        for (const FieldValue &value : surface.field_values[f]) {
            const double at = std::clamp((value.number - field.offset) / field.scale, 0.0, last);
            // Labels and maxima are stored values already: no mean of them is taken.
            const double rounded = field.average == FieldAverage::mean ? at : std::round(at);
            all[f].values.push_back(std::isfinite(value.number) ? static_cast<std::int32_t>(std::lround(
                                                                      std::ldexp(rounded, FieldSamples::kFraction)))
                                                                : FieldSamples::kNone);
        }
    }
    return all;
}

} // namespace pbm::build
