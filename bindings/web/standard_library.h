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

// numbers.cpp has no more of it than libraries need.
extern "C" [[deprecated("has no effect in pbm.wasm: use std::to_chars")]] int snprintf(char *, size_t, const char *,
                                                                                       ...);
// callbacks.js: the text of a number without its end; `digits` as of to_chars, 0 for the shortest.
extern "C" int pbm_web_print(double number, int digits, char *text);

namespace std {

template <class To, class From> constexpr To bit_cast(const From &from) noexcept {
    static_assert(sizeof(To) == sizeof(From) && is_trivially_copyable_v<To> && is_trivially_copyable_v<From>);
    return __builtin_bit_cast(To, from);
}

template <class T> unique_ptr<T> make_unique_for_overwrite() { return unique_ptr<T>(new T); }
template <class Array> unique_ptr<Array> make_unique_for_overwrite(size_t count) {
    return unique_ptr<Array>(new remove_extent_t<Array>[count]);
}

// As "%.*g" prints it.
inline to_chars_result to_chars(char *first, char *last, double number, chars_format, int digits) {
    array<char, 40> text{};
    const auto size = static_cast<ptrdiff_t>(pbm_web_print(number, digits, text.data()));
    return size <= last - first ? to_chars_result{copy_n(text.data(), size, first), {}}
                                : to_chars_result{last, errc::value_too_large};
}

// The shortest text that is read as the same number; fixed if that is no longer than scientific.
inline to_chars_result to_chars(char *first, char *last, double number) {
    return to_chars(first, last, number, chars_format::general, 0);
}

} // namespace std
