// Fields: measured quantities of points, such as intensity or class, beside the attributes that every picture needs.
// BVG.md 17
//
//   value of a point = offset + scale x (stored - 1)        stored 1 .. 255 or 65,535; stored 0: the point has no value
#pragma once

#include "system/bytes.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace pbm {

inline constexpr std::size_t kMaxFields = 8;
inline constexpr std::size_t kMaxFieldName = 32, kMaxFieldUnit = 16; // bytes of UTF-8

// How a node gets its value from the points of the finest level below it that have one. BVG.md 17.3
enum class FieldAverage : std::uint8_t { mean = 0, majority = 1, maximum = 2 };
inline constexpr std::size_t kFieldAverages = 3;
inline std::string_view to_string(FieldAverage average) {
    constexpr std::array<std::string_view, kFieldAverages> kNames{"mean", "majority", "max"};
    return kNames[static_cast<std::size_t>(average)];
}

struct Field {
    std::string name;       // 1..kMaxFieldName bytes, printable; no two fields of a file have the same
    std::string unit;       // as people write it, "m"; may be empty
    double offset = 0;      // value of stored 1; finite
    double scale = 1;       // step of the values; finite, above 0
    std::uint8_t bytes = 1; // of a stored value: 1 or 2, little-endian
    FieldAverage average = FieldAverage::mean;
    bool operator==(const Field &) const = default;

    std::uint32_t max_stored() const { return bytes == 1 ? 255 : 65535; }
    double value(std::uint32_t stored) const { return offset + scale * (static_cast<double>(stored) - 1); }
};

// The stored value of point `i` in a column of a field.
inline std::uint32_t stored_value(ByteView column, std::size_t i, std::uint8_t bytes) {
    return bytes == 1 ? column[i] : static_cast<std::uint32_t>(column[2 * i] | column[2 * i + 1] << 8);
}
inline void set_stored_value(std::span<std::uint8_t> column, std::size_t i, std::uint8_t bytes, std::uint32_t stored) {
    column[bytes * i] = static_cast<std::uint8_t>(stored);
    if (bytes == 2)
        column[2 * i + 1] = static_cast<std::uint8_t>(stored >> 8);
}

} // namespace pbm
