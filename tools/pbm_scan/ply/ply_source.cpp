#include "pbm_scan/ply/ply_source.h"

#include "pbm_scan/text/printable.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pbm::build {
namespace {

bool ends_line(char c) { return c == '\n' || c == '\r'; }

bool fits(PlyScalar type, double value) {
    if (is_float(type))
        return true;
    return with_scalar(type, [value](auto example) {
        using Limits = std::numeric_limits<decltype(example)>;
        return value >= static_cast<double>(Limits::lowest()) && value <= static_cast<double>(Limits::max()) &&
               value == std::trunc(value);
    });
}

} // namespace

bool AsciiSource::refuse(std::string what) {
    fault = std::move(what);
    return false;
}

// Advances `at_` to the next word, on any line.
bool AsciiSource::skip_space() {
    for (; at_ != end_; ++at_) {
        if (!ends_word(*at_))
            return true;
        if (*at_ == '\n' || (*at_ == '\r' && (at_ + 1 == end_ || at_[1] != '\n')))
            ++line_;
    }
    return false;
}

bool AsciiSource::number(PlyScalar type, double &value) {
    if (!skip_space()) {
        offset = static_cast<std::size_t>(end_ - begin_);
        return refuse("the file ends here: it is cut short");
    }
    offset = static_cast<std::size_t>(at_ - begin_);
    const char *word_end = parse_number(at_, end_, value);
    if (word_end == nullptr) {
        const std::string_view word(at_, static_cast<std::size_t>(std::find_if(at_, end_, ends_word) - at_));
        return refuse(printable_in_quotes(word) + " is not a number" +
                      (word.find(',') != std::string_view::npos ? "; decimals need a point" : ""));
    }
    const char *word = std::exchange(at_, word_end);
    if (!fits(type, value))
        return refuse(printable_in_quotes({word, static_cast<std::size_t>(word_end - word)}) + " does not fit type " +
                      std::string(to_string(type)));
    return true;
}

bool AsciiSource::begin_list(const PlyProperty &property, std::size_t &length) {
    double value = 0;
    if (!number(property.count_type, value))
        return false;
    // Every entry takes a digit and, but for the last one of the file, a space.
    if (!is_length(value, left() / 2 + 1))
        return refuse("a list of " + number_text(value) + " entries does not fit into the rest of the file");
    length = static_cast<std::size_t>(value);
    return true;
}

bool AsciiSource::end_row() {
    while (at_ != end_ && ends_word(*at_) && !ends_line(*at_))
        ++at_;
    if (at_ == end_ || ends_line(*at_))
        return true;
    offset = static_cast<std::size_t>(at_ - begin_);
    return refuse("more values on the line than the header announces");
}

} // namespace pbm::build
