// Classes of points as LAS numbers and names them, for fields of that name. LAS 1.4 R15, table 17
#pragma once

#include "system/error.h"

#include <bitset>
#include <cstdint>
#include <string>
#include <string_view>

namespace pbm {

inline constexpr std::uint32_t kLasClasses = 19; // with names

// "ground", "high vegetation", ..; empty for other numbers.
std::string_view class_name(std::uint32_t number);

// Parses a list with commas between its parts: numbers from 0 to 255, names of classes, and names of several classes
// alike: "vegetation", "noise", "wire". Letters may have any case, and words may have "_" or a space between them.
//
// errors  usage  a part is neither
Result<std::bitset<256>> parse_classes(const std::string &list);

// "2,6,18": such a list.
std::string list_of(const std::bitset<256> &classes);

} // namespace pbm
