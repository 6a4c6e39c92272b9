// Words and lines of texts, for counting.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::mutants {

using Words = std::vector<std::string>;

inline constexpr const char *kWhite = " \t\v\f\r\n";

inline Words words(const std::string &line) {
    Words all;
    for (std::size_t at = line.find_first_not_of(kWhite); at != std::string::npos;) {
        const std::size_t end = std::min(line.find_first_of(kWhite, at), line.size());
        all.push_back(line.substr(at, end - at));
        at = line.find_first_not_of(kWhite, end);
    }
    return all;
}

// Line ends: LF, CR LF, CR.
inline std::vector<std::string> lines(std::string_view text) {
    std::vector<std::string> all(1);
    for (std::size_t i = 0; i < text.size(); ++i)
        if (text[i] == '\n' || (text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n')))
            all.emplace_back();
        else
            all.back() += text[i];
    return all;
}

inline bool whole_number(const std::string &word, long long &value) {
    char *end = nullptr;
    value = std::strtoll(word.c_str(), &end, 10);
    return !word.empty() && *end == '\0';
}

// As strtod has it, with the exponents of Fortran and what old libraries write for numbers that are not finite.
inline bool is_number(std::string word, double &value) {
    const std::size_t sign = word.starts_with('-') || word.starts_with('+') ? 1 : 0;
    for (const char *name : {"1.#IND", "1.#QNAN", "1.#INF", "1.#SNAN"})
        if (word.compare(sign, std::strlen(name), name) == 0)
            word = "nan";
    for (char &c : word)
        c = c == 'd' || c == 'D' ? 'e' : c;
    char *end = nullptr;
    value = std::strtod(word.c_str(), &end);
    return !word.empty() && *end == '\0';
}

inline std::string lower(std::string word) {
    for (char &c : word)
        c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return word;
}

inline std::string without_mark(std::string_view bytes) {
    return std::string(bytes.substr(bytes.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0));
}

} // namespace pbm::mutants
