#include "pbm_scan/table/text_cloud.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/table/cell_style.h"
#include "pbm_scan/table/point_table.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/files/file_names.h"
#include "system/free_memory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace pbm::build {
namespace {

constexpr std::size_t kMaxColumns = 64;

// Whether all values of three columns from `first` on are such, but for missing ones.
template <class Is> bool all_are(std::span<const double> values, std::size_t columns, std::size_t first, const Is &is) {
    bool has_some = false;
    for (std::size_t row = 0; row + columns <= values.size(); row += columns) {
        const glm::dvec3 three(values[row + first], values[row + first + 1], values[row + first + 2]);
        if (!is_finite(three))
            continue;
        if (!is(three.x, three.y, three.z))
            return false;
        has_some = true;
    }
    return has_some;
}

std::string numbered_column(std::size_t index) { return "column " + std::to_string(index + 1); }

// What the last four columns are, if all are whole numbers of 0..255.
struct LastFour {
    bool begin_with_colour = false; // an opacity or a label follows; else they are an intensity and a colour, as in PTS
    bool is_sure = false;
};

LastFour judge_last_four(std::span<const double> values, std::size_t columns) {
    constexpr double kOpaque = 255, kMaxLabel = 31;
    const bool is_one_row = values.size() < 2 * columns;
    const bool is_opaque = values.back() == kOpaque;
    bool is_constant = !is_one_row || is_opaque, is_label = true, is_first_constant = true, is_first_label = true,
         is_grey = true, is_one_colour = true;
    for (std::size_t row = columns; row <= values.size(); row += columns) {
        const double first = values[row - 4], last = values[row - 1];
        is_constant = is_constant && last == values[columns - 1];
        is_first_constant = is_first_constant && first == values[columns - 4];
        is_grey = is_grey && values[row - 3] == last && values[row - 2] == last;
        is_one_colour =
            is_one_colour && values[row - 3] == values[columns - 3] && values[row - 2] == values[columns - 2];
        is_label = is_label && last <= kMaxLabel;
        is_first_label = is_first_label && first <= kMaxLabel;
    }
    const bool is_plain_grey = is_grey && !is_first_constant; // points without colours, which have one grey
    const bool is_plain_intensity = is_first_constant && !is_one_colour && !is_opaque;
    if (is_constant && (is_plain_grey || is_plain_intensity))
        return {};
    return {is_constant || (is_label && !is_first_label), is_constant};
}

// Whether the first column counts the rows from 0 or 1.
bool counts_rows(std::span<const double> values, std::size_t columns) {
    constexpr std::size_t kMinRows = 3;
    if (columns < 4 || values.size() < kMinRows * columns || (values[0] != 0 && values[0] != 1))
        return false;
    for (std::size_t row = 1; row * columns < values.size(); ++row)
        if (values[row * columns] != values[0] + static_cast<double>(row))
            return false;
    return true;
}

struct GuessedColumns {
    std::vector<std::string> names;
    std::string doubt{}; // what else they may be, for the report
};

// Names for columns without any.
GuessedColumns guess_columns(std::span<const double> values, std::size_t columns) {
    GuessedColumns guess;
    std::vector<std::string> &names = guess.names;
    const auto is_unit = [](double x, double y, double z) {
        const double squared = x * x + y * y + z * z;
        return squared == 0 || std::abs(squared - 1) < 0.02;
    };
    const auto is_colour = [](double r, double g, double b) {
        const auto is_byte = [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); };
        return is_byte(r) && is_byte(g) && is_byte(b);
    };
    const auto is_fraction = [](double r, double g, double b) {
        const auto is_unit_range = [](double v) { return v >= 0 && v <= 1; };
        return is_unit_range(r) && is_unit_range(g) && is_unit_range(b);
    };
    const auto has_colour_or_normal = [&] {
        return columns >= 6 && (all_are(values, columns, 3, is_colour) || all_are(values, columns, 3, is_unit) ||
                                (columns == 6 && all_are(values, columns, 3, is_fraction)));
    };
    if (counts_rows(values, columns) && !has_colour_or_normal()) {
        names.emplace_back("number");
        guess.doubt = "; the first counts the rows";
    }
    names.insert(names.end(), {"x", "y", "z"});
    const std::size_t first = names.size();
    // Whether the columns from here on begin with a colour; all four of the last ones may be bytes.
    const auto is_colour_at = [&](std::size_t at, std::size_t left) {
        if (left == 3 && all_are(values, columns, at, is_fraction)) // as Open3D writes .xyzrgb
            return true;
        if (left < 3 || !all_are(values, columns, at, is_colour))
            return false;
        if (left != 4 || !all_are(values, columns, at + 1, is_colour))
            return true;
        const LastFour last = judge_last_four(values, columns);
        if (!last.is_sure)
            guess.doubt += last.begin_with_colour ? "; the last four may also be an intensity and a colour"
                                                  : "; the last four may also be a colour and a measurement";
        return last.begin_with_colour;
    };
    bool has_normals = false, has_colours = false;
    while (names.size() < columns) {
        const std::size_t at = names.size(), left = columns - at;
        if (left >= 3 && !has_normals && all_are(values, columns, at, is_unit)) {
            names.insert(names.end(), {"nx", "ny", "nz"});
            has_normals = true;
        } else if (!has_colours && is_colour_at(at, left)) {
            names.insert(names.end(), {"r", "g", "b"});
            has_colours = true;
        } else if (at == first && (left == 1 || left == 4)) {
            names.emplace_back("intensity");
        } else {
            names.push_back(numbered_column(at));
        }
    }
    return guess;
}

class TextCloud {
  public:
    // `text`: with decimal points, in the same places as those of `original`.
    TextCloud(std::string_view text, std::string_view original, const CellStyle &style, const ReadOptions &options)
        : text_(text), original_(original), style_(style), options_(options), lines_(text), names_(options.columns),
          has_comments_(text.find('#') != std::string_view::npos || text.find("//") != std::string_view::npos) {}

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
        std::string doubt;
        if (is_guess) {
            GuessedColumns guess = guess_columns(values_, columns_);
            names_ = std::move(guess.names);
            doubt = std::move(guess.doubt);
        }
        std::vector<ColumnRole> roles = roles_of(names_);
        for (const ColumnRole axis : {ColumnRole::x, ColumnRole::y, ColumnRole::z})
            if (std::find(roles.begin(), roles.end(), axis) == roles.end())
                return bad_input("the columns '" + listed(names_) + "' have no x, y and z");
        Surface surface;
        const std::vector<KeptColumn> kept = keep_fields(names_, roles, options_, surface);
        PointTable table;
        const std::size_t count = values_.size() / columns_;
        table.resize(count, roles);
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < columns_; ++k)
                table.set(i, roles[k], values_[i * columns_ + k]);
        free_memory(values_);
        fill_surface(std::move(table), names_, roles, kept, surface);
        if (!options_.columns.empty())
            surface.report.push_back({"columns", Fate::kept, "as --columns names them"});
        if (is_guess && columns_ > 3)
            surface.report.push_back(
                line_of(Warning::guessed_columns, "columns", "guessed as " + listed(names_) + doubt));
        if (style_.decimal_comma)
            surface.report.push_back({"decimal sign", Fate::kept, "a comma"});
        if (empty_cells_ != 0)
            surface.report.push_back(
                {"empty cells", Fate::kept, counted(empty_cells_, "cell") + ": no value of that point"});
        if (comments_ != 0)
            surface.report.push_back({"comments", Fate::kept,
                                      counted(comments_, "line") + " behind the first point, or end of a line, "
                                                                   "that begins with # or //"});
        if (skipped_ != 0)
            surface.report.push_back({"text", Fate::dropped,
                                      counted(skipped_, "row") + " of text before the first point: " +
                                          printable_in_quotes(first_skipped_) + " is not a number"});
        if (open_end_)
            report_open_end(surface.report);
        return finished(std::move(surface), options_);
    }

  private:
    // The same place of the text as the file has it.
    std::string_view as_in_file(std::string_view part) const {
        return original_.substr(static_cast<std::size_t>(part.data() - text_.data()), part.size());
    }

    // The names of columns on this line, behind a comment sign; empty: x, y or z is not among them.
    std::vector<std::string> names_by(char separator) {
        lines_.rewind();
        std::string_view line = as_in_file(lines_.rest());
        if (const std::size_t first = line.find_first_not_of(kBlanks);
            first != std::string_view::npos && (line[first] == '#' || line[first] == '/')) {
            line.remove_prefix(std::min(line.find_first_not_of("#/", first), line.size()));
            line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
            if (const std::string_view word = line.substr(0, line.find_first_of(kBlanks)); word.ends_with(':'))
                line.remove_prefix(word.size()); // "# Columns: x y z"
        }
        std::vector<std::string> names = text_cells(line, separator);
        while (!names.empty() && names.back().empty())
            names.pop_back();
        if (names.size() > kMaxColumns)
            return {};
        for (std::size_t i = 0; i < names.size(); ++i)
            if (names[i].empty())
                names[i] = numbered_column(i);
        make_distinct(names);
        const std::vector<ColumnRole> roles = roles_of(names);
        const auto has = [&](ColumnRole role) { return std::find(roles.begin(), roles.end(), role) != roles.end(); };
        const bool has_places = has(ColumnRole::x) && has(ColumnRole::y) && has(ColumnRole::z);
        return has_places ? names : std::vector<std::string>();
    }

    // Rows may be divided in another way than their names.
    void take_names() {
        for (const char separator : {style_.separator, ',', ';', '\t', ' '})
            if (names_.empty())
                names_ = names_by(separator);
    }

    void push(double value) {
        for (; empty_ != 0; --empty_, ++empty_cells_) // the cells before this one
            row_.push_back(std::numeric_limits<double>::quiet_NaN());
        row_.push_back(value);
    }

    // Takes a cell that is no bare number: a number in quotes, or text in a column that the user skips.
    bool take_text(const Cell &cell) {
        const std::size_t column = row_.size() + empty_;
        const bool is_skipped = column < options_.columns.size() && options_.columns[column] == kSkippedColumn;
        double value = std::numeric_limits<double>::quiet_NaN();
        const bool is_quoted_number = cell.is_quoted && is_number(cell.text, value);
        if (is_quoted_number || is_skipped)
            push(value);
        numbers_ += is_quoted_number ? 1U : 0U;
        return is_quoted_number || is_skipped;
    }

    // These read the numbers of a line, and return the first cell that is no number, or nothing.
    std::string_view read_words(std::string_view line) {
        const char *at = line.data();
        const char *const end = at + line.size();
        while (row_.size() <= kMaxColumns) {
            while (at != end && ends_word(*at))
                ++at;
            if (at == end)
                break;
            double value = 0;
            const char *next = parse_number(at, end, value);
            if (next != nullptr) {
                row_.push_back(value);
                ++numbers_;
            } else {
                std::string_view rest(at, end);
                const Cell cell = take_cell(rest, ' ');
                if (!take_text(cell))
                    return cell.text;
                next = rest.data();
            }
            at = next;
        }
        return {};
    }
    std::string_view read_cells(std::string_view line) {
        const char *at = line.data();
        const char *const end = at + line.size();
        const auto is_blank = [this](char c) { return c != style_.separator && ends_word(c); };
        while (row_.size() <= kMaxColumns) {
            const char *cell_end = std::find(at, end, style_.separator);
            const char *const first = std::find_if_not(at, cell_end, is_blank);
            double value = 0;
            const char *const next = first == cell_end ? nullptr : parse_number(first, cell_end, value);
            if (next != nullptr && std::find_if_not(next, cell_end, is_blank) == cell_end) {
                push(value);
                ++numbers_;
            } else {
                std::string_view rest(at, end);
                const Cell cell = take_cell(rest, style_.separator);
                if (cell.text.empty())
                    ++empty_;
                else if (!take_text(cell))
                    return cell.text;
                cell_end = cell.is_last ? end : rest.data() - 1;
            }
            if (cell_end == end)
                break;
            at = cell_end + 1;
        }
        return {};
    }

    // Whether a line is no row of names or units: two of its cells are numbers, or all of them have a digit.
    bool is_like_row(std::string_view line) const {
        const std::vector<std::string> cells = text_cells(line, style_.separator);
        double value = 0;
        const auto has_digit = [](const std::string &cell) {
            return cell.find_first_of("0123456789") != std::string::npos;
        };
        return std::count_if(cells.begin(), cells.end(), [&](const auto &cell) { return is_number(cell, value); }) >=
                   2 ||
               std::all_of(cells.begin(), cells.end(), has_digit);
    }

    Status line() {
        std::string_view line = lines_.rest();
        if (has_comments_) {
            const std::string_view bare = without_comment(line, style_.separator == '\t' ? '\t' : '\0');
            const bool has_comment = bare.size() != line.size();
            line = bare;
            if (has_comment && columns_ != 0 && style_.separator != ' ') {
                const std::vector<std::string> cells = text_cells(lines_.rest(), style_.separator);
                const auto error = std::find_if(cells.begin(), cells.end(), is_error_value);
                if (cells.size() == columns_ && error != cells.end())
                    return lines_.refuse(printable_in_quotes(*error) + " in column " +
                                         std::to_string(error - cells.begin() + 1) + " is not a number");
            }
            if (trimmed(line, kBlanks).empty() && has_comment) {
                comments_ += columns_ != 0 ? 1U : 0U;
                if (columns_ == 0 && names_.empty())
                    take_names();
                return {};
            }
            comments_ += has_comment ? 1U : 0U;
        }
        row_.clear();
        numbers_ = empty_ = 0;
        const std::string_view odd = style_.separator == ' ' ? read_words(line) : read_cells(line);
        if (!odd.empty()) {
            if (columns_ == 0 && numbers_ == 0 && (names_.empty() || !is_like_row(line)))
                return text(as_in_file(odd));
            return lines_.refuse(printable_in_quotes(as_in_file(odd)) + " in column " +
                                 std::to_string(row_.size() + empty_ + 1) +
                                 " is not a number; '-' in --columns skips a column of text");
        }
        if (row_.size() > kMaxColumns)
            return lines_.refuse("more than " + std::to_string(kMaxColumns) + " columns");
        if (row_.empty()) // blanks or separators only
            return {};
        if (row_.size() == 1 && empty_ == 0)
            return count_of_points();
        return row();
    }

    // A row of text before the points, whose first one names the columns. `first`: its first cell.
    Status text(std::string_view first) {
        if (lines_.number() == 1 && lower_case(first).starts_with("sep=")) // Excel's word for the separator
            return {};
        const bool has_names = !names_.empty();
        if (!has_names)
            take_names();
        if (names_.empty())
            return lines_.refuse(printable_in_quotes(first) +
                                 " begins neither a row of numbers nor names with x, y and z; if this is a table of "
                                 "points, --columns says what its columns are");
        const bool is_header = !has_names || (!options_.columns.empty() && !has_header_);
        has_header_ = has_header_ || is_header;
        constexpr std::uint64_t kMaxSkipped = 3; // titles and units
        if (!is_header && skipped_ == kMaxSkipped)
            return lines_.refuse("a fourth row of text behind the names: " + printable_in_quotes(first) +
                                 " is not a number");
        if (!is_header && skipped_++ == 0)
            first_skipped_ = first;
        return {};
    }

    // Empty cells at the end of a row are missing values where there are such columns, and nothing elsewhere.
    void complete_row() {
        const std::size_t columns = columns_ != 0 ? columns_ : names_.size();
        while (row_.size() < columns && empty_ != 0) {
            row_.push_back(std::numeric_limits<double>::quiet_NaN());
            --empty_;
            ++empty_cells_;
        }
    }

    // Of columns beyond those of --columns.
    Status complete_names() {
        if (names_.empty() || names_.size() == row_.size())
            return {};
        const std::string found = "a row of " + std::to_string(row_.size()) + " numbers";
        if (options_.columns.empty())
            return lines_.refuse(found + " below " + std::to_string(names_.size()) + " names" +
                                 (style_.separator == ' ' ? "; names with spaces need quotes" : ""));
        if (names_.size() > row_.size())
            return lines_.refuse(found + ", and --columns has " + std::to_string(names_.size()) + " names",
                                 ErrorCode::usage);
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
        complete_row();
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
            options_.progress(static_cast<double>(lines_.offset()) / static_cast<double>(text_.size()));
        return {};
    }

    std::string_view text_, original_;
    CellStyle style_;
    const ReadOptions &options_;
    Lines lines_;
    std::vector<std::string> names_;
    std::vector<double> row_, values_;    // values: [rows][columns]
    std::size_t numbers_ = 0, empty_ = 0; // of the row: cells with a number; empty ones at its end
    std::uint64_t empty_cells_ = 0;       // of all rows
    std::size_t columns_ = 0;
    std::uint64_t rows_ = 0, count_line_ = 0, skipped_ = 0;
    std::string first_skipped_;
    std::optional<std::uint64_t> announced_; // points up to the next count
    const bool has_comments_;
    std::uint64_t comments_ = 0;                 // behind the first point
    bool open_end_ = false, has_header_ = false; // a row of text that names the columns
};

} // namespace

Result<std::vector<std::string>> parse_columns(const std::string &list) {
    std::vector<std::string> names;
    for (const std::string_view part : split(list)) {
        const std::string &name = names.emplace_back(lower_case(trimmed(part)));
        if (name.empty() || (name != kSkippedColumn && std::find(names.begin(), names.end(), name) + 1 != names.end()))
            return usage_error(printable_in_quotes(list) +
                               " has a column without a name, or two of one name; '-' skips one");
    }
    const std::vector<ColumnRole> roles = roles_of(names);
    for (const ColumnRole axis : {ColumnRole::x, ColumnRole::y, ColumnRole::z})
        if (std::find(roles.begin(), roles.end(), axis) == roles.end())
            return usage_error(printable_in_quotes(list) + " has no columns x, y and z");
    return names;
}

Result<Surface> read_text_cloud(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    if (const Status status = refuse_nul(as_text(bytes)); !status)
        return status.error();
    std::string line_feeds, points;
    const std::string_view text = with_line_feeds(as_text(bytes), line_feeds);
    const Result<CellStyle> style = find_cell_style(text);
    if (!style)
        return style.error();
    if (!style->decimal_comma)
        return TextCloud(text, text, *style, options).run();
    points = text;
    for (char &c : points) // a point is no decimal sign here
        c = c == ',' ? '.' : c == '.' ? ',' : c;
    return TextCloud(points, text, *style, options).run();
}

} // namespace pbm::build
