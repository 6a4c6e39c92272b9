#include "pbm_scan/text/text_number.h"

#include <cstddef>
#include <limits>

namespace pbm::build {
namespace {

constexpr std::array<double, 23> kPowersOfTen{1,    1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                              1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

// What C libraries of Microsoft wrote until 2015 for a number that is not finite ("1.#INF", "-1.#IND00"), and numbers
// with an exponent of Fortran ("1.5D+03").
std::optional<double> old_number(std::string_view word) {
    constexpr std::size_t kMaxBytes = 64;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const std::string_view size = word.substr(word.starts_with('-') || word.starts_with('+') ? 1 : 0);
    if (size.starts_with("1.#")) {
        const std::string_view name = size.substr(3, size.find_last_not_of('0') - 2);
        if (name == "INF")
            return word.front() == '-' ? -kInfinity : kInfinity;
        if (name == "IND" || name == "QNAN" || name == "SNAN" || name == "NAN")
            return std::numeric_limits<double>::quiet_NaN();
        return std::nullopt;
    }
    const std::size_t exponent = size.find_first_of("Dd");
    if (exponent == std::string_view::npos || exponent == 0 || size.size() > kMaxBytes ||
        size.substr(0, exponent).find_first_not_of("0123456789.") != std::string_view::npos)
        return std::nullopt;
    std::string text(word.front() == '+' ? size : word);
    text[text.find_first_of("Dd")] = 'e';
    return parse_all<double>(text);
}

// Many digits, large exponents, '+', inf and nan, and old_number.
const char *parse_odd_number(const char *first, const char *last, double &value) {
    const char *word_end = first;
    while (word_end != last && !ends_word(*word_end))
        ++word_end;
    const bool plus = first != word_end && *first == '+';
    const char *digits = first + (plus ? 1 : 0);
    if (plus && digits != word_end && *digits == '-')
        return nullptr;
    const auto [end, status] = std::from_chars(digits, word_end, value);
    if (end != word_end || status == std::errc::invalid_argument) {
        const std::optional<double> old = old_number({first, word_end});
        value = old.value_or(value);
        return old ? word_end : nullptr;
    }
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

// Reads the exponent whose letter is at `at`: size = digits x 10^(power + exponent). False if that might not be rounded
// correctly, or is no exponent.
bool scale(const char *&at, const char *last, std::uint64_t digits, std::ptrdiff_t power, double &size) {
    constexpr auto kPowers = static_cast<std::ptrdiff_t>(kPowersOfTen.size());
    if (last - at < 2)
        return false;
    const bool negative = at[1] == '-';
    const char *const first = at + (negative || at[1] == '+' ? 2 : 1);
    std::uint64_t exponent = 0;
    at = append_digits(first, last, exponent);
    if (at == first || at - first > 3)
        return false;
    power += negative ? -static_cast<std::ptrdiff_t>(exponent) : static_cast<std::ptrdiff_t>(exponent);
    if (power <= -kPowers || power >= kPowers)
        return false;
    const double factor = kPowersOfTen[static_cast<std::size_t>(power < 0 ? -power : power)];
    size = power < 0 ? static_cast<double>(digits) / factor : static_cast<double>(digits) * factor;
    return true;
}

} // namespace

// A whole number of at most 53 bits and a power of ten up to 10^22 are exact in a double, so one product or quotient of
// them is rounded correctly (Clinger. How to read floating point numbers accurately. 1990). Other numbers go to
// from_chars.
const char *parse_number(const char *first, const char *last, double &value) {
    if (first == last)
        return nullptr;
    constexpr std::uint64_t kExact = std::uint64_t{1} << 53;
    const bool minus = *first == '-';
    const char *const begin = first + (minus ? 1 : 0);
    std::uint64_t digits = 0;
    const char *p = append_digits(begin, last, digits);
    std::ptrdiff_t length = p - begin, decimals = 0;
    if (p != last && *p == '.') {
        const char *const point = p + 1;
        p = append_digits(point, last, digits);
        decimals = p - point;
        length += decimals;
    }
    if (length < 1 || length > kMaxDigits || digits > kExact)
        return parse_odd_number(first, last, value);
    double size =
        static_cast<double>(static_cast<std::int64_t>(digits)) / kPowersOfTen[static_cast<std::size_t>(decimals)];
    if (p != last && !ends_word(*p) &&
        !((*p == 'e' || *p == 'E') && scale(p, last, digits, -decimals, size) && (p == last || ends_word(*p))))
        return parse_odd_number(first, last, value);
    value = minus ? -size : size;
    return p;
}

const char *parse_long_count(const char *first, const char *last, std::uint64_t &value) {
    const auto [end, status] = std::from_chars(first, last, value);
    return status == std::errc() && (end == last || ends_word(*end)) ? end : nullptr;
}

std::string number_text(double value) {
    constexpr double kExact = 9007199254740992.0; // 2^53
    if (value >= -kExact && value <= kExact && value == static_cast<double>(static_cast<std::int64_t>(value)))
        return std::to_string(static_cast<std::int64_t>(value));
    return std::to_string(value);
}

} // namespace pbm::build
