// Lines and words of a text that is edited in place, for the checks of mesh_text.h.
#pragma once

#include "pbm_scan/surface/surface.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pbm::build {

inline bool is_number(std::string_view word, double &value) {
    return parse_number(word.data(), word.data() + word.size(), value) == word.data() + word.size();
}

// Whether a float, and so OpenMesh, can represent it without overflow.
inline bool fits_float(double value) {
    return std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max());
}

// The lines of a text that is edited in place.
class Lines {
  public:
    explicit Lines(std::string &text) : text_(text) {}

    // The next line, without its end. LF and CR LF; `unify_white_space` has turned a lone CR into LF.
    bool next() {
        if (at_ >= text_.size())
            return false;
        begin_ = at_;
        const std::size_t end = text_.find('\n', at_);
        terminated_ = end != std::string::npos;
        end_ = terminated_ ? end : text_.size();
        at_ = end_ + 1;
        ++number_;
        word_ = begin_;
        return true;
    }
    // The next line that is not blank. Blanks comments first where '#' begins one.
    bool next_with_words(bool has_comments) {
        while (next()) {
            if (has_comments)
                strip_comment();
            const bool says_something = !word().empty();
            rewind();
            if (says_something)
                return true;
        }
        return false;
    }
    // The next word of the line; empty at its end.
    std::string_view word() {
        while (word_ < end_ && ends_word(text_[word_]))
            ++word_;
        const std::size_t first = word_;
        while (word_ < end_ && !ends_word(text_[word_]))
            ++word_;
        return std::string_view(text_).substr(first, word_ - first);
    }
    std::string_view rest() const { return std::string_view(text_).substr(word_, end_ - word_); }
    // The rest of the line without white space around it.
    std::string_view trimmed_rest() const {
        std::string_view text = rest();
        while (!text.empty() && ends_word(text.front()))
            text.remove_prefix(1);
        while (!text.empty() && ends_word(text.back()))
            text.remove_suffix(1);
        return text;
    }
    // The numbers on the rest of the line: their count, and the first nine.
    struct Numbers {
        std::size_t count = 0;
        std::array<double, 9> first{};
        bool fit_floats = true;
    };
    Status numbers(Numbers &out) {
        for (std::string_view text = word(); !text.empty(); text = word()) {
            double value = 0;
            if (!is_number(text, value))
                return refuse(printable_in_quotes(text) + " is not a number");
            out.fit_floats = out.fit_floats && fits_float(value);
            if (out.count < out.first.size())
                out.first[out.count] = value;
            ++out.count;
        }
        return {};
    }
    void rewind() { word_ = begin_; }
    void blank() { blank_from(begin_); }
    void blank_rest() { blank_from(word_); }
    // Blanks the line after its first `words`.
    void blank_after(std::size_t words) {
        for (rewind(); words > 0; --words)
            word();
        blank_rest();
    }
    void strip_comment() {
        const std::string_view line = std::string_view(text_).substr(begin_, end_ - begin_);
        blank_from(begin_ + std::min(line.find('#'), line.size()));
    }
    // Ends the line after the current word.
    void break_line() {
        if (word_ < end_)
            text_[word_] = '\n';
    }
    void replace(std::string_view by) { // where the line is long enough for `by`
        blank();
        text_.replace(begin_, by.size(), by);
    }
    bool terminated() const { return terminated_; }
    std::uint64_t number() const { return number_; }
    std::size_t offset() const { return begin_; }
    Error refuse(const std::string &what, ErrorCode code = ErrorCode::bad_input) const {
        return {code, begin_, "line " + std::to_string(number_) + ": " + what};
    }

  private:
    void blank_from(std::size_t at) { text_.replace(at, end_ - at, end_ - at, ' '); }

    std::string &text_;
    std::size_t at_ = 0, begin_ = 0, end_ = 0, word_ = 0;
    std::uint64_t number_ = 0;
    bool terminated_ = true;
};

inline std::string_view as_text(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char *>(bytes.data()), bytes.size()};
}

// Whether it begins with the byte order mark of UTF-8.
inline bool has_mark(std::string_view text) { return text.starts_with("\xEF\xBB\xBF"); }

// The same with the byte order mark blanked; keeps the length.
inline std::string as_unmarked_text(std::span<const std::uint8_t> bytes) {
    std::string text(as_text(bytes));
    if (has_mark(text))
        text.replace(0, 3, 3, ' ');
    return text;
}

inline bool is_utf16(std::string_view text) { return text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"); }
inline constexpr const char *kUtf16 = "text in UTF-16; convert it, as with iconv -f UTF-16 -t UTF-8";

inline Status refuse_nul(const std::string &text) {
    if (is_utf16(text))
        return bad_input(kUtf16, 0);
    const std::size_t nul = text.find('\0');
    if (nul != std::string::npos)
        return bad_input("a NUL byte in a text file: it is damaged; export the scan again", nul);
    return {};
}

// Replaces CR LF and CR by LF, and other white space by a space, since OpenMesh skips lines that begin with a form
// feed. Keeps the length.
inline void unify_white_space(std::string &text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '\r')
            text[i] = i + 1 < text.size() && text[i + 1] == '\n' ? ' ' : '\n';
        if (text[i] == '\v' || text[i] == '\f')
            text[i] = ' ';
    }
}

inline bool same_word(std::string_view word, std::string_view lower_case) {
    return std::equal(word.begin(), word.end(), lower_case.begin(), lower_case.end(),
                      [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
}

inline std::size_t different(std::vector<std::uint32_t> corners) {
    std::sort(corners.begin(), corners.end());
    return static_cast<std::size_t>(std::unique(corners.begin(), corners.end()) - corners.begin());
}

// The first three of `corners` that differ; there are three.
inline std::array<std::uint32_t, 3> three_different(std::span<const std::uint32_t> corners) {
    const auto second = std::find_if(corners.begin(), corners.end(), [&](auto c) { return c != corners.front(); });
    const auto third =
        std::find_if(second, corners.end(), [&](auto c) { return c != corners.front() && c != *second; });
    return {corners.front(), *second, *third};
}

inline void drop_once(std::vector<AttributeReport> &report, const std::string &name, std::string note) {
    const auto same = [&name](const AttributeReport &line) { return line.name == name; };
    if (std::none_of(report.begin(), report.end(), same))
        report.push_back({name, Fate::dropped, std::move(note)});
}

// A missing last line end may mean a truncated file, but many whole files have none.
inline void report_open_end(std::vector<AttributeReport> &report) {
    report.push_back({"end of file", Fate::kept,
                      "the last line has no line end: if the file was cut, its last number may be wrong"});
}

} // namespace pbm::build
