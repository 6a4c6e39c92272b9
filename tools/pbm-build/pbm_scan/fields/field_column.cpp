#include "pbm_scan/fields/field_column.h"

#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/words.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <charconv>

namespace pbm::build {
namespace {

std::string plain_name(std::string_view name) {
    std::string plain = lower_case(name);
    std::replace_if(
        plain.begin(), plain.end(), [](char c) { return c == ' ' || c == '-'; }, '_');
    for (const std::string_view prefix : {"vertex.", "scalar_"})
        if (plain.starts_with(prefix))
            plain.erase(0, prefix.size());
    return plain;
}

// LAS 1.4 R15, table 17
struct ClassName {
    std::string_view name;
    std::array<int, 3> classes; // -1: none
};
constexpr std::array kClassNames{
    ClassName{"created", {0, -1, -1}},   ClassName{"unclassified", {1, -1, -1}}, ClassName{"ground", {2, -1, -1}},
    ClassName{"vegetation", {3, 4, 5}},  ClassName{"building", {6, -1, -1}},     ClassName{"noise", {7, 18, -1}},
    ClassName{"key_point", {8, -1, -1}}, ClassName{"water", {9, -1, -1}},        ClassName{"rail", {10, -1, -1}},
    ClassName{"road", {11, -1, -1}},     ClassName{"overlap", {12, -1, -1}},     ClassName{"wire", {13, 14, 16}},
    ClassName{"tower", {15, -1, -1}},    ClassName{"bridge", {17, -1, -1}}};

bool add_classes(std::string_view word, std::bitset<256> &classes) {
    unsigned number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error == std::errc() && end == word.data() + word.size()) {
        if (number > 255)
            return false;
        classes.set(number);
        return true;
    }
    const auto *const found = std::find_if(kClassNames.begin(), kClassNames.end(),
                                           [&](const ClassName &known) { return known.name == plain_name(word); });
    if (found == kClassNames.end())
        return false;
    for (const int number_of_class : found->classes)
        if (number_of_class >= 0)
            classes.set(static_cast<std::size_t>(number_of_class));
    return true;
}

} // namespace

bool is_same_field(std::string_view wanted, std::string_view in_file) {
    return plain_name(wanted) == plain_name(in_file);
}

bool is_label(std::string_view name) {
    const std::string plain = plain_name(name);
    constexpr std::array<std::string_view, 10> kLabels{
        "classification",    "class",        "label",     "segment", "cluster", "return_number",
        "number_of_returns", "point_source", "user_data", "id"};
    return std::find(kLabels.begin(), kLabels.end(), plain) != kLabels.end() || plain.ends_with("_id") ||
           plain.ends_with("_label") || plain.ends_with("_class");
}

Result<std::bitset<256>> parse_classes(const std::string &list) {
    std::bitset<256> classes;
    for (const std::string_view part : split(list))
        if (!add_classes(part, classes))
            return usage(
                "'" + printable(list) +
                "' is no list of classes; write numbers from 0 to 255, or ground, vegetation, building, noise, "
                "water, rail, road, wire, tower, bridge, overlap, unclassified, with commas between them");
    return classes;
}

FieldColumn::FieldColumn(Surface &surface, const ReadOptions &options, std::string_view name, std::string_view unit)
    : surface_(&surface) {
    for (std::size_t slot = 0; slot < options.fields.size(); ++slot)
        if (is_same_field(options.fields[slot], name) && !surface.field_units[slot]) {
            surface.field_units[slot] = std::string(unit);
            slots_.push_back(slot);
        }
    if (options.dropped_classes.any() && is_same_field("classification", name) && !surface.field_units[kMaxFields]) {
        surface.field_units[kMaxFields] = unit;
        slots_.push_back(kMaxFields);
    }
    surface.offered_fields.emplace_back(plain_name(name));
}

AttributeReport field_report(const std::string &name, const FieldColumn &column, std::string_view reason) {
    if (column.is_kept())
        return {name, Fate::kept, "a field"};
    return {name, Fate::dropped, std::string(reason) + "; --field keeps it"};
}

} // namespace pbm::build
