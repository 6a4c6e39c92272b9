#include "pbm_scan/table/text_cloud.h"

#include "pbm_scan/table/point_table.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace pbm::build {
namespace {

constexpr std::size_t kMostColumns = 64;
constexpr std::size_t kSample = 1000; // rows that guesses look at

// The text with white space between numbers; the text itself where it has that already.
std::string_view with_spaces(std::string_view text, std::string &storage) {
    const std::string_view head = text.substr(0, 4096);
    const bool semicolons = head.find(';') != std::string_view::npos;
    if (!semicolons && head.find(',') == std::string_view::npos)
        return text;
    storage = text;
    for (char &c : storage)
        c = c == ';' ? ' ' : c != ',' ? c : semicolons ? '.' : ' ';
    return storage;
}

bool is_comment(std::string_view word) { return word.starts_with('#') || word.starts_with("//"); }

// Whether all values of three columns from `first` on are such.
template <class Is> bool all_are(std::span<const double> sample, std::size_t columns, std::size_t first, const Is &is) {
    for (std::size_t row = 0; row + columns <= sample.size(); row += columns)
        if (!is(sample[row + first], sample[row + first + 1], sample[row + first + 2]))
            return false;
    return true;
}

std::string numbered_column(std::size_t index) { return "column " + std::to_string(index + 1); }

// Names for columns without any.
std::vector<std::string> guessed_names(std::span<const double> sample, std::size_t columns) {
    std::vector<std::string> names{"x", "y", "z"};
    const auto is_unit = [](double x, double y, double z) {
        const double squared = x * x + y * y + z * z;
        return squared == 0 || std::abs(squared - 1) < 0.02;
    };
    const auto is_colour = [](double r, double g, double b) {
        const auto is_byte = [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); };
        return is_byte(r) && is_byte(g) && is_byte(b);
    };
    bool has_normals = false, has_colours = false;
    while (names.size() < columns) {
        const std::size_t at = names.size(), left = columns - at;
        if (left >= 3 && !has_normals && all_are(sample, columns, at, is_unit)) {
            names.insert(names.end(), {"nx", "ny", "nz"});
            has_normals = true;
        } else if (left >= 3 && !has_colours && left != 4 && all_are(sample, columns, at, is_colour)) {
            names.insert(names.end(), {"r", "g", "b"});
            has_colours = true;
        } else if (at == 3 && (left == 1 || left == 4)) {
            names.emplace_back("intensity");
        } else {
            names.push_back(numbered_column(at));
        }
    }
    return names;
}

class TextCloud {
  public:
    TextCloud(std::string_view text, const ReadOptions &options)
        : size_(text.size()), options_(options), lines_(text), names_(options.columns) {}

    Result<Surface> run() {
        while (lines_.next())
            if (const Status read = line(); !read)
                return read.error();
        if (announced_ && rows_ < *announced_)
            return bad_input("line " + std::to_string(count_line_) + " announces " + std::to_string(*announced_) +
                             " points, and " + std::to_string(rows_) +
                             " follow: the file is cut short; copy or export it again");
        if (columns_ == 0)
            return bad_input("the text has no row of three numbers or more: it is no table of points");
        const bool is_guess = names_.empty();
        if (is_guess)
            names_ = guessed_names(std::span(values_).first(std::min(values_.size(), kSample * columns_)), columns_);
        std::vector<ColumnRole> roles = roles_of(names_);
        for (const ColumnRole axis : {ColumnRole::x, ColumnRole::y, ColumnRole::z})
            if (std::find(roles.begin(), roles.end(), axis) == roles.end())
                return bad_input("the columns " + printable_in_quotes(joined(names_, ", ")) + " have no x, y and z");
        Surface surface;
        const std::vector<KeptColumn> kept = keep_fields(names_, roles, options_, surface);
        PointTable table;
        const std::size_t count = values_.size() / columns_;
        table.resize(count, roles);
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < columns_; ++k)
                table.set(i, roles[k], values_[i * columns_ + k]);
        values_ = {};
        fill_surface(std::move(table), names_, roles, kept, surface);
        if (!options_.columns.empty())
            surface.report.push_back({"columns", Fate::kept, "as --columns names them"});
        if (is_guess && columns_ > 3)
            surface.report.push_back({"columns", Fate::converted, "guessed as " + joined(names_, ", ")});
        if (skipped_ != 0)
            surface.report.push_back({"text", Fate::dropped,
                                      counted(skipped_, "row") + " of text before the first point: " +
                                          printable_in_quotes(first_skipped_) + " is not a number"});
        if (open_end_)
            report_open_end(surface.report);
        return finished(std::move(surface), options_);
    }

  private:
    // The words of the line behind a comment sign and without quotes, if they name columns.
    void take_names() {
        lines_.rewind();
        std::vector<std::string> names;
        for (std::string_view word = lines_.word(); !word.empty() && names.size() <= kMostColumns;
             word = lines_.word()) {
            if (names.empty())
                word.remove_prefix(std::min(word.find_first_not_of("#/"), word.size()));
            word = trimmed(word, "\"'");
            if (!word.empty())
                names.emplace_back(word);
        }
        const std::vector<ColumnRole> roles = roles_of(names);
        const auto has = [&](ColumnRole role) { return std::find(roles.begin(), roles.end(), role) != roles.end(); };
        if (has(ColumnRole::x) && has(ColumnRole::y) && has(ColumnRole::z))
            names_ = std::move(names);
    }

    Status line() {
        const std::string_view first = lines_.word();
        if (first.empty())
            return {};
        double value = 0;
        if (!is_number(first, value)) {
            if (is_comment(first) || columns_ == 0)
                return text(first);
            return lines_.refuse(printable_in_quotes(first) + " is not a number");
        }
        lines_.rewind();
        row_.clear();
        for (std::string_view word = lines_.word(); !word.empty() && !is_comment(word); word = lines_.word()) {
            if (!is_number(word, value))
                return lines_.refuse(printable_in_quotes(word) + " is not a number");
            if (row_.size() == kMostColumns)
                return lines_.refuse("more than " + std::to_string(kMostColumns) + " columns");
            row_.push_back(value);
        }
        if (row_.size() == 1)
            return count_of_points();
        return row();
    }

    // A comment, or a row of text before the points, whose first one names the columns.
    Status text(std::string_view first) {
        const bool has_names = !names_.empty();
        if (columns_ == 0 && !has_names)
            take_names();
        if (is_comment(first))
            return {};
        if (names_.empty())
            return lines_.refuse(printable_in_quotes(first) + " begins no row of a table of points");
        const bool is_header = !has_names || (!options_.columns.empty() && !has_header_);
        has_header_ = has_header_ || is_header;
        if (!is_header && skipped_++ == 0)
            first_skipped_ = first;
        return {};
    }

    // Of columns beyond those of --columns.
    Status complete_names() {
        if (names_.empty() || names_.size() == row_.size())
            return {};
        const std::string found = "a row of " + std::to_string(row_.size()) + " numbers",
                          named = std::to_string(names_.size()) + " names";
        if (options_.columns.empty())
            return lines_.refuse(found + " below " + named);
        if (names_.size() > row_.size())
            return lines_.refuse(found + ", and --columns has " + named);
        while (names_.size() < row_.size())
            names_.push_back(numbered_column(names_.size()));
        return {};
    }

    // Counts stand before the points, or between blocks of them.
    Status count_of_points() {
        const double count = row_.front();
        if (!(count >= 0 && count <= static_cast<double>(kMaxVertices) && count == std::floor(count)) ||
            (columns_ != 0 && (!announced_ || rows_ < *announced_)))
            return lines_.refuse("a row of one number");
        announced_ = rows_ + static_cast<std::uint64_t>(count);
        count_line_ = lines_.number();
        return {};
    }

    Status row() {
        if (columns_ == 0) {
            if (row_.size() < 3)
                return lines_.refuse("a row of fewer than three numbers");
            if (Status named = complete_names(); !named)
                return named;
            columns_ = row_.size();
        }
        if (row_.size() != columns_)
            return lines_.refuse("a row of " + std::to_string(row_.size()) + " numbers, others have " +
                                 std::to_string(columns_) + ": the file is cut short or damaged");
        if (rows_ == kMaxVertices)
            return lines_.refuse("more than 2^31 - 1 points; split the scan", ErrorCode::too_large);
        if (announced_ && rows_ == *announced_)
            return lines_.refuse("a point behind the " + std::to_string(*announced_) + " that are announced");
        ++rows_;
        values_.insert(values_.end(), row_.begin(), row_.end());
        open_end_ = !lines_.terminated();
        if (options_.progress && rows_ % 65536 == 0)
            options_.progress(static_cast<double>(lines_.offset()) / static_cast<double>(size_));
        return {};
    }

    std::size_t size_;
    const ReadOptions &options_;
    Lines lines_;
    std::vector<std::string> names_;
    std::vector<double> row_, values_; // values: [rows][columns]
    std::size_t columns_ = 0;
    std::uint64_t rows_ = 0, count_line_ = 0, skipped_ = 0;
    std::string first_skipped_;
    std::optional<std::uint64_t> announced_;     // points up to the next count
    bool open_end_ = false, has_header_ = false; // a row of text that names the columns
};

} // namespace

Result<std::vector<std::string>> parse_columns(const std::string &list) {
    std::vector<std::string> names;
    for (const std::string_view part : split(list)) {
        const std::string &name = names.emplace_back(lower_case(trimmed(part)));
        if (name.empty() || (name != kSkippedColumn && std::find(names.begin(), names.end(), name) + 1 != names.end()))
            return usage(printable_in_quotes(list) + " has a column without a name, or two of one name; '-' skips one");
    }
    const std::vector<ColumnRole> roles = roles_of(names);
    for (const ColumnRole axis : {ColumnRole::x, ColumnRole::y, ColumnRole::z})
        if (std::find(roles.begin(), roles.end(), axis) == roles.end())
            return usage(printable_in_quotes(list) + " has no columns x, y and z");
    return names;
}

Result<Surface> read_text_cloud(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    if (const Status status = refuse_nul(as_text(bytes)); !status)
        return status.error();
    std::string line_feeds, spaces;
    return TextCloud(with_spaces(with_line_feeds(as_text(bytes), line_feeds), spaces), options).run();
}

} // namespace pbm::build
