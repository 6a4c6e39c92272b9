// Converts rows of a PLY element to columns: blocks of rows of a binary element without lists, or single numbers.
#pragma once

#include "pbm_scan/ply/ply_source.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace pbm::build {

// The destination of the values of one property.
struct Column {
    enum class Kind : std::uint8_t { none, float64, float32, uint8 };
    Kind kind = Kind::none;
    std::uint8_t *first = nullptr;
    std::size_t stride = 0; // bytes
};

template <class To, class From, bool Swap>
void gather(const std::uint8_t *from, std::size_t row_size, std::size_t rows, std::uint8_t *to, std::size_t stride) {
    for (std::size_t i = 0; i < rows; ++i) {
        const To value = static_cast<To>(load_scalar<From, Swap>(from + i * row_size));
        std::memcpy(to + i * stride, &value, sizeof value);
    }
}

template <bool Swap>
void gather(const std::uint8_t *from, PlyScalar type, std::size_t row_size, std::size_t rows, const Column &column,
            std::size_t first_row) {
    std::uint8_t *to = column.first + first_row * column.stride;
    with_scalar(type, [&](auto example) {
        using From = decltype(example);
        switch (column.kind) {
        case Column::Kind::float64: return gather<double, From, Swap>(from, row_size, rows, to, column.stride);
        case Column::Kind::float32: return gather<float, From, Swap>(from, row_size, rows, to, column.stride);
        case Column::Kind::uint8: return gather<std::uint8_t, From, Swap>(from, row_size, rows, to, column.stride);
        case Column::Kind::none: return;
        }
    });
}

inline void set_value(const Column &column, std::size_t row, double value) {
    gather<false>(reinterpret_cast<const std::uint8_t *>(&value), PlyScalar::float64, sizeof value, 1, column, row);
}

} // namespace pbm::build
