// Numbers in text files: decimal point, optional exponent and sign, `inf` and `nan`, "1.#IND" and the like of old C
// libraries, exponents of Fortran; no locale.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace pbm::build {

// White space of the text formats (PLY, OBJ, OFF, STL).
inline bool ends_word(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// Parses the number that begins at `first` and ends at white space or `last`. Correctly rounded; overflow gives
// infinity, underflow zero. Returns its end, or null for no number.
const char *parse_number(const char *first, const char *last, double &value);

// Digits that 64 bits hold.
inline constexpr std::ptrdiff_t kMaxDigits = 19;

// Appends the digits from `at` on to `number`, which overflows beyond kMaxDigits. Returns their end.
inline const char *append_digits(const char *at, const char *last, std::uint64_t &number) {
    for (unsigned digit = 0; at != last && (digit = static_cast<unsigned>(*at) - '0') <= 9; ++at)
        number = 10 * number + digit;
    return at;
}

// Parses the word at `first` if it is a whole number without a sign, of at most 64 bits. Returns its end, or null.
// parse_long_count: parse_count for a word of more than kMaxDigits digits, some of which may be leading zeros.
const char *parse_long_count(const char *first, const char *last, std::uint64_t &value);
inline const char *parse_count(const char *first, const char *last, std::uint64_t &value) {
    value = 0;
    const char *const end = append_digits(first, last, value);
    if (end - first > kMaxDigits)
        return parse_long_count(first, last, value);
    return end != first && (end == last || ends_word(*end)) ? end : nullptr;
}

// Parses all of `text` as a number; integers in base `base`. Nothing if it is no number or more than a number.
template <class T, class... Base> std::optional<T> parse_all(std::string_view text, Base... base) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
    return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

// The shortest text that reads back as the same number.
template <class T> std::string shortest_text(T value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

// For messages: whole numbers without decimals.
std::string number_text(double value);

} // namespace pbm::build
