#include "pbm_format/model/las_classes.h"

#include "system/letters.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace pbm {
namespace {

struct LasClass {
    std::string_view name, group; // `group`: what classes alike are called
};
constexpr std::array<LasClass, kLasClasses> kClasses{{{"never classified", "created"},
                                                      {"unclassified", "unclassified"},
                                                      {"ground", "ground"},
                                                      {"low vegetation", "vegetation"},
                                                      {"medium vegetation", "vegetation"},
                                                      {"high vegetation", "vegetation"},
                                                      {"building", "building"},
                                                      {"low noise", "noise"},
                                                      {"key point", "key point"},
                                                      {"water", "water"},
                                                      {"rail", "rail"},
                                                      {"road surface", "road"},
                                                      {"overlap", "overlap"},
                                                      {"wire guard", "wire"},
                                                      {"wire conductor", "wire"},
                                                      {"transmission tower", "tower"},
                                                      {"wire connector", "wire"},
                                                      {"bridge deck", "bridge"},
                                                      {"high noise", "noise"}}};

bool add_classes(std::string word, std::bitset<256> &classes) {
    unsigned number = 0;
    const char *const end = word.data() + word.size();
    if (const auto [after, error] = std::from_chars(word.data(), end, number); error == std::errc() && after == end) {
        if (number < classes.size())
            classes.set(number);
        return number < classes.size();
    }
    std::transform(word.begin(), word.end(), word.begin(), [](char c) { return c == '_' ? ' ' : lower_case(c); });
    bool is_known = false;
    for (std::size_t i = 0; i < kClasses.size(); ++i)
        if (word == kClasses[i].name || word == kClasses[i].group) {
            classes.set(i);
            is_known = true;
        }
    return is_known;
}

} // namespace

std::string_view class_name(std::uint32_t number) {
    return number < kClasses.size() ? kClasses[number].name : std::string_view();
}

Result<std::bitset<256>> parse_classes(const std::string &list) {
    std::bitset<256> classes;
    for (std::size_t at = 0; at <= list.size();) {
        const std::size_t comma = std::min(list.find(',', at), list.size());
        if (!add_classes(list.substr(at, comma - at), classes))
            return usage_error(std::string("'").append(list).append(
                "' is no list of classes; write numbers from 0 to 255, or ground, vegetation, building, "
                "noise, water, rail, road, wire, tower, bridge, overlap, unclassified, with commas "
                "between them"));
        at = comma + 1;
    }
    return classes;
}

std::string list_of(const std::bitset<256> &classes) {
    std::string list;
    for (std::size_t i = 0; i < classes.size(); ++i)
        if (classes[i])
            list.append(list.empty() ? "" : ",").append(std::to_string(i));
    return list;
}

} // namespace pbm
