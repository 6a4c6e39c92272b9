#include "pbm_scan/text/printable.h"

#include <array>
#include <cstdarg>
#include <cstdio>

namespace pbm::build {

std::string printable(std::string_view text) {
    constexpr std::size_t kMost = 40;
    std::string out;
    for (const char c : text.substr(0, kMost))
        out += c >= ' ' && c <= '~' ? c : '?';
    return out + (text.size() > kMost ? "..." : "");
}

std::string printable_in_quotes(std::string_view text) {
    return std::string(1, '\'').append(printable(text)).append(1, '\'');
}

std::string counted(std::uint64_t count, const char *what) {
    std::string noun = what;
    if (count != 1)
        noun = noun.ends_with("vertex") ? noun.substr(0, noun.size() - 2) + "ices" : noun + "s";
    return std::to_string(count) + " " + noun;
}

std::string formatted(const char *format, ...) {
    std::array<char, 256> text{};
    std::va_list values;
    va_start(values, format);
    std::vsnprintf(text.data(), text.size(), format, values);
    va_end(values);
    return text.data();
}

} // namespace pbm::build
