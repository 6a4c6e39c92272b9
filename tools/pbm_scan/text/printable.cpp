#include "pbm_scan/text/printable.h"

#include "pbm_scan/text/text_number.h"
#include "system/utf8.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>

namespace pbm::build {

std::string printable(std::string_view text) {
    constexpr std::size_t kMax = 40;
    // Marks that have no width or turn the direction of what follows could make a message say something else.
    const auto is_mark = [](char32_t code) {
        return (code >= 0x200B && code <= 0x200F) || (code >= 0x2028 && code <= 0x202E) ||
               (code >= 0x2060 && code <= 0x206F) || code == 0x061C || code == 0xFEFF;
    };
    std::string out;
    for (std::size_t count = 0; !text.empty(); ++count) {
        if (count == kMax)
            return out + "...";
        const Utf8Character next = utf8_character(text);
        const std::size_t bytes = std::max<std::size_t>(next.bytes, 1);
        if (next.bytes == 0 || is_control(next.code) || is_mark(next.code))
            out += '?';
        else
            out += text.substr(0, bytes);
        text.remove_prefix(bytes);
    }
    return out;
}

std::string printable_in_quotes(std::string_view text) {
    return std::string(1, '\'').append(printable(text)).append(1, '\'');
}

namespace {

// How many names from the first on are numbered upwards: "q7", "q8", "q9".
std::size_t numbered_names(std::span<const std::string> names) {
    const std::string &first = names.front();
    const std::size_t stem = first.find_last_not_of("0123456789") + 1;
    const auto number = parse_all<std::uint32_t>(std::string_view(first).substr(stem));
    std::size_t count = 1;
    while (number && count < names.size() && names[count] == first.substr(0, stem) + std::to_string(*number + count))
        ++count;
    return count;
}

} // namespace

std::string listed(std::span<const std::string> names, std::string_view separator) {
    constexpr std::size_t kMinNumbered = 5, kMaxEntries = 64;
    std::string text;
    for (std::size_t entries = 0; !names.empty(); ++entries) {
        (text += text.empty() ? "" : separator) +=
            entries == kMaxEntries ? std::to_string(names.size()) + " more" : printable(names.front());
        if (entries == kMaxEntries)
            break;
        const std::size_t numbered = numbered_names(names), taken = numbered < kMinNumbered ? 1 : numbered;
        if (taken > 1)
            text.append("..").append(printable(names[taken - 1]));
        names = names.subspan(taken);
    }
    return text;
}

std::string enumerated(std::span<const std::string> names) {
    return names.size() < 2 ? listed(names) : listed(names.first(names.size() - 1)) + " and " + names.back();
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
