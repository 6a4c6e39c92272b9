// Characters of UTF-8 (RFC 3629).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace pbm {

struct Utf8Character {
    char32_t code = 0;
    std::size_t bytes = 0; // 1..4; 0: the text does not begin with a character
};

// The first character of `text`.
inline Utf8Character utf8_character(std::string_view text) {
    const auto byte = [&](std::size_t k) {
        return k < text.size() ? static_cast<std::uint8_t>(text[k]) : std::uint8_t{0};
    };
    const std::uint8_t first = byte(0);
    if (first < 0x80)
        return {first, text.empty() ? 0U : 1U};
    const std::size_t further = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
    char32_t code = first & (0x3FU >> further);
    for (std::size_t k = 1; k <= further; ++k) {
        if ((byte(k) & 0xC0) != 0x80)
            return {};
        code = code << 6 | (byte(k) & 0x3FU);
    }
    constexpr std::array<char32_t, 4> kMin{0, 0x80, 0x800, 0x10000};
    if (first < 0xC2 || first > 0xF4 || code < kMin[further] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000))
        return {};
    return {code, 1 + further};
}

inline bool is_control(char32_t code) { return code < 0x20 || (code >= 0x7F && code < 0xA0); }

} // namespace pbm
