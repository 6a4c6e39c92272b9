// Columns of numbers out of the rows of a PLY element: of a binary file without lists whole blocks at once.
#pragma once

#include "pbm_scan/ply/ply_source.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace pbm::build {

// Where the values of one property go.
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
        case Column::Kind::uint8: // only ever from uchar
            if constexpr (sizeof(From) == 1)
                gather<std::uint8_t, From, Swap>(from, row_size, rows, to, column.stride);
            return;
        case Column::Kind::none: return;
        }
    });
}

inline void store(const Column &column, std::size_t row, double value) {
    std::uint8_t *to = column.first + row * column.stride;
    if (column.kind == Column::Kind::float64) {
        std::memcpy(to, &value, sizeof value);
    } else if (column.kind == Column::Kind::float32) {
        const float narrow = static_cast<float>(value);
        std::memcpy(to, &narrow, sizeof narrow);
    } else if (column.kind == Column::Kind::uint8) {
        *to = static_cast<std::uint8_t>(value);
    }
}

} // namespace pbm::build
