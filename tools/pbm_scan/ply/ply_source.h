// Reads the numbers of the body of a PLY file. AsciiSource and BinarySource have the same members:
//
//   number(type, value)      the next scalar as a double, which is exact for every type
//   begin_list(p, length)    the length of a list, verified against the rest of the file
//   end_row()                verifies that the line ends (ASCII)
//
// They return false on an error, described by `fault` and `offset`.
#pragma once

#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/text/text_number.h"
#include "system/bytes.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

namespace pbm::build {

// One scalar of a binary file. `Swap`: its byte order is not that of this machine.
template <class T, bool Swap> T load_scalar(const std::uint8_t *at) {
    using Bits =
        std::conditional_t<sizeof(T) == 1, std::uint8_t,
                           std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                              std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
    auto bits = load<Bits>(at);
    if constexpr (Swap && sizeof(T) == 2)
        bits = __builtin_bswap16(bits);
    if constexpr (Swap && sizeof(T) == 4)
        bits = __builtin_bswap32(bits);
    if constexpr (Swap && sizeof(T) == 8)
        bits = __builtin_bswap64(bits);
    return std::bit_cast<T>(bits);
}

// Calls `use` with a value of the C++ type that `type` names.
template <class Use> auto with_scalar(PlyScalar type, Use use) {
    switch (type) {
    case PlyScalar::int8: return use(std::int8_t{});
    case PlyScalar::uint8: return use(std::uint8_t{});
    case PlyScalar::int16: return use(std::int16_t{});
    case PlyScalar::uint16: return use(std::uint16_t{});
    case PlyScalar::int32: return use(std::int32_t{});
    case PlyScalar::uint32: return use(std::uint32_t{});
    case PlyScalar::float32: return use(float{});
    case PlyScalar::float64: break;
    }
    return use(double{});
}

// Whether a list length is a whole number of at most `most` entries.
inline bool is_length(double value, std::uint64_t most) {
    return value >= 0 && value <= static_cast<double>(most) &&
           value == static_cast<double>(static_cast<std::uint64_t>(value));
}

template <bool Swap> class BinarySource {
  public:
    static constexpr bool kIsText = false;
    static constexpr bool kSwap = Swap;

    BinarySource(std::span<const std::uint8_t> bytes, std::size_t at) : offset(at), bytes_(bytes) {}

    bool number(PlyScalar type, double &value) {
        return with_scalar(type, [&](auto example) {
            if (left() < sizeof example)
                return ended();
            value = static_cast<double>(load_scalar<decltype(example), Swap>(bytes_.data() + offset));
            offset += sizeof example;
            return true;
        });
    }
    bool begin_list(const PlyProperty &property, std::size_t &length) {
        const std::size_t start = offset;
        double value = 0;
        if (!number(property.count_type, value))
            return false;
        if (!is_length(value, left() / size_of(property.type))) {
            offset = start;
            fault = "a list of " + number_text(value) + " entries does not fit into the rest of the file";
            if (other_order_fits(property, left() / size_of(property.type)))
                fault += kOtherOrder;
            return false;
        }
        length = static_cast<std::size_t>(value);
        return true;
    }
    bool end_row() { return true; }
    static constexpr const char *kOtherOrder =
        Swap == (std::endian::native == std::endian::little)
            ? " (in the other byte order it would fit: 'format binary_big_endian 1.0' is probably wrong)"
            : " (in the other byte order it would fit: 'format binary_little_endian 1.0' is probably wrong)";
    bool skip(std::size_t size) {
        if (left() < size)
            return ended();
        offset += size;
        return true;
    }
    std::size_t left() const { return bytes_.size() - offset; }
    const std::uint8_t *data() const { return bytes_.data() + offset; }
    std::string place() const { return "byte " + std::to_string(offset); }

    std::size_t offset; // of the next number, or of a fault
    std::string fault;
    bool order_is_open = true; // the data has not confirmed the byte order yet

  private:
    // Whether the invalid length at `offset` would be valid with its bytes swapped.
    bool other_order_fits(const PlyProperty &property, std::uint64_t most) const {
        BinarySource<!Swap> other(bytes_, offset);
        double value = 0;
        return order_is_open && size_of(property.count_type) > 1 && other.number(property.count_type, value) &&
               is_length(value, most);
    }
    bool ended() {
        fault = "the file ends here: it is cut short";
        return false;
    }
    std::span<const std::uint8_t> bytes_;
};

class AsciiSource {
  public:
    static constexpr bool kIsText = true;

    AsciiSource(std::span<const std::uint8_t> bytes, std::size_t at, std::uint64_t line)
        : begin_(reinterpret_cast<const char *>(bytes.data())), end_(begin_ + bytes.size()), at_(begin_ + at),
          line_(line) {}

    bool number(PlyScalar type, double &value);
    bool begin_list(const PlyProperty &property, std::size_t &length);
    bool end_row();
    std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
    std::string place() const { return "line " + std::to_string(line_); }

    std::size_t offset = 0; // of the last number, and of a fault
    std::string fault;

  private:
    bool skip_space();
    bool refuse(std::string what);

    const char *begin_, *end_, *at_;
    std::uint64_t line_;
};

} // namespace pbm::build
