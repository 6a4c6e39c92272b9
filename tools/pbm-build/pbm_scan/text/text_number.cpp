#include "pbm_scan/text/text_number.h"

#include <cstddef>
#include <cstdint>
#include <limits>

namespace pbm::build {
namespace {

constexpr std::array<double, 16> kPowersOfTen{1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                              1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

// Exponents, many digits, '+', inf and nan.
const char *parse_odd_number(const char *first, const char *last, double &value) {
    const char *word_end = first;
    while (word_end != last && !ends_word(*word_end))
        ++word_end;
    const bool plus = first != word_end && *first == '+';
    const char *digits = first + (plus ? 1 : 0);
    if (plus && digits != word_end && *digits == '-')
        return nullptr;
    const auto [end, status] = std::from_chars(digits, word_end, value);
    if (end != word_end || status == std::errc::invalid_argument)
        return nullptr;
    if (status == std::errc::result_out_of_range) {
        const std::string_view word(first, static_cast<std::size_t>(word_end - first));
        const std::size_t exponent = word.find_first_of("eE");
        const bool tiny = exponent == std::string_view::npos ? word.find('.') < 3 // 0.000... with hundreds of zeros
                                                             : word.substr(exponent + 1, 1) == "-";
        const double size = tiny ? 0.0 : std::numeric_limits<double>::infinity();
        value = *first == '-' ? -size : size;
    }
    return end;
}

} // namespace

// A decimal of at most 15 digits and the power of ten are exact in a double, so one division rounds correctly (Clinger.
// How to read floating point numbers accurately. 1990). Other numbers go to from_chars.
const char *parse_number(const char *first, const char *last, double &value) {
    if (first == last)
        return nullptr;
    const char *p = first;
    const bool minus = *p == '-';
    p += minus ? 1 : 0;
    std::uint64_t digits = 0;
    int length = 0;
    std::size_t decimals = 0;
    for (; p != last && *p >= '0' && *p <= '9' && length < 16; ++p, ++length)
        digits = 10 * digits + static_cast<std::uint64_t>(*p - '0');
    if (p != last && *p == '.')
        for (++p; p != last && *p >= '0' && *p <= '9' && length < 16; ++p, ++length, ++decimals)
            digits = 10 * digits + static_cast<std::uint64_t>(*p - '0');
    if (length < 1 || length > 15 || (p != last && !ends_word(*p)))
        return parse_odd_number(first, last, value);
    const double size = static_cast<double>(digits) / kPowersOfTen[decimals];
    value = minus ? -size : size;
    return p;
}

std::string number_text(double value) {
    constexpr double kExact = 9007199254740992.0; // 2^53
    if (value >= -kExact && value <= kExact && value == static_cast<double>(static_cast<std::int64_t>(value)))
        return std::to_string(static_cast<std::int64_t>(value));
    return std::to_string(value);
}

} // namespace pbm::build
