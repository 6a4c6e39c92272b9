#include "pbm_scan/fields/field_column.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/words.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <unordered_map>

namespace pbm::build {
namespace {

// As --field can write it.
std::string writable(std::string_view name) {
    std::string text(name);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == ',' || c == '='; }, '_');
    return text;
}

std::string folded_name(std::string_view name) {
    std::string folded = writable(lower_case(name));
    std::replace_if(
        folded.begin(), folded.end(), [](char c) { return c == ' ' || c == '-'; }, '_');
    return folded;
}

// A folded name without prefixes.
std::string plain_name(std::string folded) {
    if (folded.starts_with("vertex."))
        folded.erase(0, folded.find('.') + 1);
    folded.erase(0, folded.find(':') + 1);
    if (folded.starts_with("scalar_"))
        folded.erase(0, folded.find('_') + 1);
    return folded;
}

} // namespace

int likeness(std::string_view wanted, std::string_view in_file) {
    if (wanted == in_file)
        return 4;
    const std::string want = folded_name(wanted), folded = folded_name(in_file), plain = plain_name(folded);
    return want == folded ? 3 : want == plain ? 2 : plain_name(want) == plain ? 1 : 0;
}

bool is_label(std::string_view name) {
    const std::string plain = plain_name(folded_name(name));
    constexpr std::array<std::string_view, 10> kLabels{
        "classification",    "class",        "label",     "segment", "cluster", "return_number",
        "number_of_returns", "point_source", "user_data", "id"};
    return std::find(kLabels.begin(), kLabels.end(), plain) != kLabels.end() || plain.ends_with("_id") ||
           plain.ends_with("_label") || plain.ends_with("_class");
}

std::vector<FieldColumn> field_columns(Surface &surface, const ReadOptions &options, std::span<const FieldOffer> offers,
                                       std::span<const std::string> usual) {
    std::vector<std::vector<std::size_t>> slots(offers.size());
    const auto best_offer = [&](std::string_view name) {
        std::pair<std::size_t, int> best{0, 0}; // and its likeness
        for (std::size_t i = 0; i < offers.size(); ++i)
            if (const int fit = likeness(name, offers[i].name); fit > best.second)
                best = {i, fit};
        return best;
    };
    const auto take = [&](std::size_t slot, std::size_t offer) {
        surface.field_units[slot] = std::string(offers[offer].unit);
        slots[offer].push_back(slot);
    };
    const auto give = [&](std::size_t slot, std::string_view name) {
        const auto [offer, fit] = best_offer(name);
        if (fit > 0)
            take(slot, offer);
        return fit > 0;
    };
    for (std::size_t slot = 0; slot < options.fields.size(); ++slot)
        give(slot, options.fields[slot]);
    for (std::size_t i = 0, slot = options.fields.size(); i < usual.size() && slot < kMaxFields; ++i, ++slot)
        if (const auto [offer, fit] = best_offer(usual[i]); fit > 0 && slots[offer].empty())
            take(slot, offer);
    if (options.dropped_classes.any() && !give(kMaxFields, "classification"))
        give(kMaxFields, "class");
    std::vector<FieldColumn> columns;
    columns.reserve(offers.size());
    for (std::size_t i = 0; i < offers.size(); ++i) {
        columns.emplace_back(surface, std::move(slots[i]));
        surface.offered_fields.push_back(writable(offers[i].name));
    }
    return columns;
}

FieldColumn field_column(Surface &surface, const ReadOptions &options, std::string_view name) {
    const FieldOffer offer{name};
    return field_columns(surface, options, {&offer, 1}, options.usual_fields).front();
}

void make_distinct(std::vector<std::string> &names) {
    std::unordered_map<std::string, int> uses; // of the names as they are given; 0: not yet
    for (const std::string &name : names)
        uses.emplace(name, 0);
    for (std::string &name : names) {
        int &number = uses[name];
        if (++number == 1 || name == kSkippedColumn)
            continue;
        std::string next;
        do
            next = name + "_" + std::to_string(number++);
        while (uses.contains(next));
        --number;
        name = std::move(next);
    }
}

AttributeReport field_report(const std::string &name, const FieldColumn &column, std::string_view reason) {
    if (column.is_wanted())
        return {name, Fate::kept, column.note()};
    return {name, Fate::dropped, std::string(reason) + "; --field keeps it"};
}

} // namespace pbm::build
