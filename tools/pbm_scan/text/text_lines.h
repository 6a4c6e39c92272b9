// Lines and words of text formats.
#pragma once

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/surface/surface.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pbm::build {

inline std::string_view as_text(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char *>(bytes.data()), bytes.size()};
}

inline bool is_number(std::string_view word, double &value) {
    return parse_number(word.data(), word.data() + word.size(), value) == word.data() + word.size();
}

// The lines of a text and the words of the current one. Lines end in LF or CR LF, see with_line_feeds.
class Lines {
  public:
    // Begins at `begin`, behind so many lines.
    explicit Lines(std::string_view text, std::size_t begin = 0, std::uint64_t lines = 0)
        : text_(text), at_(begin), number_(lines) {}

    // The next line, without its end.
    bool next() {
        if (at_ >= text_.size())
            return false;
        begin_ = at_;
        const auto *const end = static_cast<const char *>(std::memchr(text_.data() + at_, '\n', text_.size() - at_));
        terminated_ = end != nullptr;
        end_ = terminated_ ? static_cast<std::size_t>(end - text_.data()) : text_.size();
        at_ = end_ + 1;
        ++number_;
        word_ = begin_;
        return true;
    }
    // The next line that is not blank. Strips comments first where '#' begins one.
    bool next_with_words(bool has_comments) {
        while (next()) {
            if (has_comments && has_comment())
                strip_comment();
            const bool says_something = to_word();
            rewind();
            if (says_something)
                return true;
        }
        return false;
    }
    // Whether the rest of the line has a '#', looked for in large steps.
    bool has_comment() {
        if (behind_comment_ <= word_)
            behind_comment_ = std::min(text_.find('#', word_), text_.size()) + 1;
        return behind_comment_ <= end_;
    }
    // Skips white space. False at the end of the line.
    bool to_word() {
        while (word_ < end_ && ends_word(text_[word_]))
            ++word_;
        return word_ < end_;
    }
    // The next word of the line; empty at its end.
    std::string_view word() {
        to_word();
        const std::size_t first = word_;
        while (word_ < end_ && !ends_word(text_[word_]))
            ++word_;
        return text_.substr(first, word_ - first);
    }
    std::string_view rest() const { return text_.substr(word_, end_ - word_); }
    // The rest of the line without white space around it.
    std::string_view trimmed_rest() const {
        std::string_view text = rest();
        while (!text.empty() && ends_word(text.front()))
            text.remove_prefix(1);
        while (!text.empty() && ends_word(text.back()))
            text.remove_suffix(1);
        return text;
    }
    // Reads the next word if it is a whole number.
    bool count(std::uint64_t &value) {
        to_word();
        const char *const next = parse_count(at(), end(), value);
        if (next != nullptr)
            go_to(next);
        return next != nullptr;
    }
    // The numbers on the rest of the line: their count, and the first nine.
    struct Numbers {
        std::size_t count = 0;
        std::array<double, 9> first{};
    };
    Status numbers(Numbers &out) {
        const char *const end = text_.data() + end_;
        const char *at = text_.data() + word_;
        while (true) {
            while (at != end && ends_word(*at))
                ++at;
            word_ = static_cast<std::size_t>(at - text_.data());
            if (at == end)
                return {};
            double value = 0;
            const char *const next = parse_number(at, end, value);
            if (next == nullptr)
                return refuse(printable_in_quotes(word()) + " is not a number");
            if (out.count < out.first.size())
                out.first[out.count] = value;
            ++out.count;
            at = next;
        }
    }
    void rewind() { word_ = begin_; }
    // Where the next word begins, or the end of the line.
    const char *at() const { return text_.data() + word_; }
    const char *end() const { return text_.data() + end_; }
    // Goes on at `at`, within the line.
    void go_to(const char *at) { word_ = static_cast<std::size_t>(at - text_.data()); }
    // A '#' within a number that is not finite ("1.#IND") begins no comment.
    void strip_comment() {
        const std::string_view line = text_.substr(begin_, end_ - begin_);
        std::size_t at = line.find('#');
        while (at != std::string_view::npos && line.substr(0, at).ends_with("1."))
            at = line.find('#', at + 1);
        end_ = begin_ + std::min(at, line.size());
    }
    bool terminated() const { return terminated_; }
    std::uint64_t number() const { return number_; }
    std::size_t offset() const { return begin_; }
    std::size_t next_offset() const { return at_; } // of the next line
    Error refuse(const std::string &what, ErrorCode code = ErrorCode::bad_input) const {
        return {code, begin_, "line " + std::to_string(number_) + ": " + what};
    }

  private:
    std::string_view text_;
    std::size_t at_ = 0, begin_ = 0, end_ = 0, word_ = 0;
    std::size_t behind_comment_ = 0; // behind the '#' that was found last
    std::uint64_t number_ = 0;
    bool terminated_ = true;
};

inline Status refuse_nul(std::string_view text) {
    const std::size_t nul = text.find('\0');
    if (nul != std::string_view::npos)
        return bad_input("a NUL byte in a text file: it is damaged; export the scan again", nul);
    return {};
}

// The text itself, or in `storage` the same text with LF in place of each CR that ends a line alone.
inline std::string_view with_line_feeds(std::string_view text, std::string &storage) {
    const auto is_alone = [](std::string_view in, std::size_t cr) { return cr + 1 == in.size() || in[cr + 1] != '\n'; };
    std::size_t cr = text.find('\r');
    while (cr != std::string_view::npos && !is_alone(text, cr))
        cr = text.find('\r', cr + 1);
    if (cr == std::string_view::npos)
        return text;
    storage = text;
    for (; cr < storage.size(); ++cr)
        if (storage[cr] == '\r' && is_alone(storage, cr))
            storage[cr] = '\n';
    return storage;
}

inline bool same_word(std::string_view word, std::string_view lower) {
    return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                      [](char a, char b) { return lower_case(a) == b; });
}

// Adds the line unless there is one of its name.
inline void report_once(std::vector<AttributeReport> &report, AttributeReport line) {
    const auto same = [&line](const AttributeReport &other) { return other.name == line.name; };
    if (std::none_of(report.begin(), report.end(), same))
        report.push_back(std::move(line));
}
inline void drop_once(std::vector<AttributeReport> &report, const std::string &name, std::string note,
                      Warning warning = Warning::dropped_attribute) {
    report_once(report, line_of(warning, name, std::move(note)));
}

// Bytes that no part of the format accounts for. `behind`: what they follow, "behind the last point".
inline void report_trailing(std::vector<AttributeReport> &report, std::uint64_t bytes, const std::string &behind) {
    if (bytes != 0)
        report.push_back(line_of(Warning::trailing_bytes, "end of file", counted(bytes, "byte") + " " + behind));
}

// A missing last line end may mean a truncated file, but many whole files have none.
inline void report_open_end(std::vector<AttributeReport> &report) {
    report.push_back(line_of(Warning::open_end, "end of file",
                             "the last line has no line end: if the file was cut, its last number may be wrong"));
}

} // namespace pbm::build
