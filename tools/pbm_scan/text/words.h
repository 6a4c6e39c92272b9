// Splits and joins the words of options.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

inline std::string_view trimmed(std::string_view text, std::string_view blanks = " ") {
    text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
    return text.substr(0, text.find_last_not_of(blanks) + 1);
}

// White space within a line.
inline constexpr std::string_view kBlanks = " \t\r\v\f";

// Takes the first word off `words`; empty where there is none.
inline std::string_view take_word(std::string_view &words) {
    words.remove_prefix(std::min(words.find_first_not_of(kBlanks), words.size()));
    const std::string_view word = words.substr(0, words.find_first_of(kBlanks));
    words.remove_prefix(word.size());
    return word;
}

// Parts between commas; an empty text has one empty part.
inline std::vector<std::string_view> split(std::string_view text) {
    std::vector<std::string_view> parts;
    for (std::size_t begin = 0; begin <= text.size(); begin += parts.back().size() + 1)
        parts.push_back(text.substr(begin, text.find(',', begin) - begin));
    return parts;
}

// "a, b, c", with `last` before the last of several.
template <class Words> std::string joined(const Words &words, std::string_view last = ", ") {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i)
        (text += i == 0 ? "" : i + 1 == words.size() ? last : ", ") += words[i];
    return text;
}

inline std::string in_quotes(std::string_view text) { return std::string(1, '\'').append(text).append(1, '\''); }

} // namespace pbm::build
