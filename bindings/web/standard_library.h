// What the C++ library of emscripten 3.1.6 lacks of C++20. Included before every file of ours (cmake/PbmWeb.cmake).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <type_traits>

namespace std {

template <class To, class From> constexpr To bit_cast(const From &from) noexcept {
    static_assert(sizeof(To) == sizeof(From) && is_trivially_copyable_v<To> && is_trivially_copyable_v<From>);
    return __builtin_bit_cast(To, from);
}

template <class T> unique_ptr<T> make_unique_for_overwrite() { return unique_ptr<T>(new T); }
template <class Array> unique_ptr<Array> make_unique_for_overwrite(size_t count) {
    return unique_ptr<Array>(new remove_extent_t<Array>[count]);
}

// The shortest text that is read as the same number; fixed if that is no longer than scientific.
inline to_chars_result to_chars(char *first, char *last, double number) {
    array<char, 40> scientific{}, fixed{};
    int precision = 0;
    do
        snprintf(scientific.data(), scientific.size(), "%.*e", precision, number);
    while (strtod(scientific.data(), nullptr) != number && ++precision < 17);
    const int exponent = atoi(strchr(scientific.data(), 'e') + 1);
    const int length = snprintf(fixed.data(), fixed.size(), "%.*f", max(0, precision - exponent), number);
    const char *const text = length <= static_cast<int>(strlen(scientific.data())) ? fixed.data() : scientific.data();
    const auto size = static_cast<ptrdiff_t>(strlen(text));
    return size <= last - first ? to_chars_result{copy_n(text, size, first), {}}
                                : to_chars_result{last, errc::value_too_large};
}

} // namespace std
