#include "pbm_scan/table/cell_style.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::string_view kQuotes = "\"'";
constexpr std::size_t kRowBytes = 65536;                 // of rows that are looked at
constexpr std::size_t kTextBytes = std::size_t{4} << 20; // in which they are looked for

bool has(std::string_view text, char c) { return text.find(c) != std::string_view::npos; }

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    for (std::string_view word = take_word(text); !word.empty(); word = take_word(text))
        words.push_back(word);
    return words;
}

// How many numbers a line has, whatever stands between them; at most three are counted.
int numbers_in(std::string_view line) {
    constexpr std::string_view kAround = " \t\r\v\f,;\"'";
    int numbers = 0;
    for (double value = 0; numbers < 3 && !line.empty();) {
        line.remove_prefix(std::min(line.find_first_not_of(kAround), line.size()));
        const std::string_view word = line.substr(0, line.find_first_of(kAround));
        numbers += is_number(word, value) ? 1 : 0;
        line.remove_prefix(word.size());
    }
    return numbers;
}

// Some rows of a table, without comments, and the line in front of the first one.
struct Sample {
    std::string_view header;
    std::vector<std::string_view> rows;
    std::vector<std::uint64_t> numbers; // of the lines of the rows

    // From the line on that begins at `begin`, behind so many lines.
    void take(std::string_view text, std::size_t begin, std::uint64_t lines_before) {
        const bool is_cut = text.size() > begin + kTextBytes;
        Lines lines(text.substr(0, begin + kTextBytes), begin, lines_before);
        for (std::size_t bytes = 0; bytes < kRowBytes && lines.next() && (lines.terminated() || !is_cut);) {
            const std::string_view line = lines.rest(), row = without_comment(line, '\0');
            const std::size_t words = words_of(line).size();
            if (numbers_in(row) == 3) {
                rows.push_back(row);
                numbers.push_back(lines.number());
                bytes += row.size();
            } else if (rows.empty() && words != 0 && !(words == 1 && numbers_in(line) == 1)) { // no count of points
                header = line;
            }
        }
    }
};

// Whether a word is made of what numbers are made of, and of commas.
bool is_numeric(std::string_view word) { return word.find_first_not_of("0123456789+-.,eE") == std::string_view::npos; }

// Whether the commas of a row can be decimal signs.
bool has_decimal_commas(std::string_view row) {
    const std::vector<std::string_view> words = words_of(row);
    const auto fits = [](std::string_view word) {
        return !has(word, ',') || (std::count(word.begin(), word.end(), ',') == 1 && word.front() != ',' &&
                                   word.back() != ',' && is_numeric(word));
    };
    return words.size() >= 3 && std::all_of(words.begin(), words.end(), fits);
}

// A number of which it is not clear what its comma is, or nothing: a row has a comma and a point between semicolons
// (1.200;567,5;8,5), or among words of which none begins or ends with a comma (1,234.5 2,345.6 3,4); or it has commas
// within words and at their ends, at most one within (1,5, 2,5, 3,5).
std::string_view unclear_number(std::string_view row) {
    const std::size_t comma = row.find(',');
    if (comma == std::string_view::npos)
        return {};
    const auto word_around = [&](std::size_t at) {
        constexpr std::string_view kEnds = " \t;\r";
        const std::size_t begin = row.find_last_of(kEnds, at) + 1;
        return row.substr(begin, row.find_first_of(kEnds, at) - begin);
    };
    if (has(row, ';')) {
        for (std::size_t at = row.find('.'); at != std::string_view::npos; at = row.find('.', at + 1))
            if (const std::string_view word = word_around(at);
                is_numeric(word) && std::count(word.begin(), word.end(), '.') == 1 && is_numeric(word_around(comma)))
                return word_around(comma);
        return {};
    }
    const std::vector<std::string_view> words = words_of(row);
    if (words.size() < 3 || !std::all_of(words.begin(), words.end(), is_numeric))
        return {};
    bool has_outer = false, has_lists = false;
    std::string_view with_inner;
    for (const std::string_view word : words) {
        const std::string_view inner = trimmed(word, ",");
        const auto commas = std::count(inner.begin(), inner.end(), ',');
        has_outer = has_outer || inner.size() != word.size();
        has_lists = has_lists || commas > 1;
        with_inner = commas != 0 && with_inner.empty() ? word : with_inner;
    }
    if (with_inner.empty())
        return {};
    return has(row, '.')             ? has_outer ? std::string_view() : with_inner
           : has_outer && !has_lists ? with_inner
                                     : std::string_view();
}

// Whether a cell between tabs is one number or a text, but not several numbers.
bool is_one_cell(const std::string &cell) {
    const std::vector<std::string_view> words = words_of(cell);
    double value = 0;
    return words.size() < 2 || !std::all_of(words.begin(), words.end(), [&](auto w) { return is_number(w, value); });
}

bool are_separated_by_tabs(const Sample &sample) {
    std::vector<bool> first_empties;
    bool is_full = true, differ = false, is_even = true;
    std::size_t count = 0;
    for (const std::string_view row : sample.rows) {
        const std::vector<std::string> cells = text_cells(row, '\t');
        if (!std::all_of(cells.begin(), cells.end(), is_one_cell))
            return false;
        std::vector<bool> empties;
        for (const std::string &cell : cells) {
            empties.push_back(cell.empty());
            is_full = is_full && !cell.empty();
        }
        is_even = is_even && (count == 0 || count == cells.size());
        differ = differ || (count != 0 && empties != first_empties);
        if (count == 0)
            first_empties = std::move(empties);
        count = std::max(count, cells.size());
    }
    const std::vector<std::string> names = text_cells(sample.header, '\t');
    const bool has_names = names.size() >= 3 && std::find(names.begin() + 1, names.end(), "") == names.end();
    return count >= 3 && (has_names || (is_even && is_full) || (!is_full && (differ || !is_even)));
}

} // namespace

bool is_comment(std::string_view text) {
    if (text.starts_with("//"))
        return true;
    if (!text.starts_with('#'))
        return false;
    const std::string_view word = text.substr(0, text.find_first_of(" \t,;\"\r"));
    return !word.ends_with('!') && !word.ends_with('?') && word != "#N/A";
}

bool is_error_value(std::string_view word) {
    return word.size() >= 3 && word.front() == '#' &&
           word.find_first_not_of("#ABCDEFGHIJKLMNOPQRSTUVWXYZ/!?0") == std::string_view::npos;
}

std::string_view without_comment(std::string_view line, char separator) {
    char quote = 0;
    for (std::size_t at = line.find_first_of("#/\"'"); at != std::string_view::npos;
         at = line.find_first_of("#/\"'", at + 1)) {
        if (has(kQuotes, line[at]))
            quote = quote == 0 ? line[at] : quote == line[at] ? '\0' : quote;
        else if (quote == 0 && (at == 0 || (ends_word(line[at - 1]) && line[at - 1] != separator)) &&
                 is_comment(line.substr(at)))
            return line.substr(0, at);
    }
    return line;
}

Cell take_cell(std::string_view &line, char separator) {
    const auto is_blank = [&](char c) { return c != separator && ends_word(c); };
    while (!line.empty() && is_blank(line.front()))
        line.remove_prefix(1);
    Cell cell;
    const auto ends = [&](char c) { return separator == ' ' ? ends_word(c) : c == separator; };
    std::size_t from = 0;
    if (!line.empty() && has(kQuotes, line.front()))
        for (std::size_t close = line.find(line.front(), 1); close != std::string_view::npos;
             close = line.find(line.front(), close + 2)) {
            cell.is_quoted = true;
            from = close + 1;
            if (from == line.size() || line[from] != line.front()) // two quotes stand for one
                break;
        }
    const auto end = static_cast<std::size_t>(
        std::find_if(line.begin() + static_cast<std::ptrdiff_t>(from), line.end(), ends) - line.begin());
    cell.text = trimmed(line.substr(0, end), kBlanks);
    if (cell.is_quoted && cell.text.size() == from) // nothing behind the closing quote
        cell.text = trimmed(cell.text.substr(1, from - 2), kBlanks);
    cell.is_last = end == line.size();
    line.remove_prefix(std::min(end + 1, line.size()));
    return cell;
}

std::vector<std::string> text_cells(std::string_view line, char separator) {
    std::vector<std::string> cells;
    if (separator == ' ')
        line = trimmed(line, kBlanks);
    while (!line.empty() || (!cells.empty() && separator != ' ')) {
        const Cell cell = take_cell(line, separator);
        cells.emplace_back(cell.text);
        if (cell.is_last)
            break;
    }
    return cells;
}

Result<CellStyle> find_cell_style(std::string_view text) {
    Sample sample;
    sample.take(text, 0, 0);
    const auto some_have = [&](char c) {
        return std::any_of(sample.rows.begin(), sample.rows.end(), [&](auto row) { return has(row, c); });
    };
    // Later rows may have decimals where the first ones are whole.
    const auto behind = static_cast<std::size_t>(sample.rows.empty() ? 0 : sample.rows.back().data() - text.data());
    if (const std::size_t comma = text.find(',', behind); !some_have(',') && comma != std::string_view::npos) {
        const std::size_t begin = text.rfind('\n', comma) + 1;
        sample.take(text, begin,
                    static_cast<std::uint64_t>(
                        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(begin), '\n')));
    }
    for (std::size_t i = 0; i < sample.rows.size(); ++i)
        if (const std::string_view unclear = unclear_number(sample.rows[i]); !unclear.empty())
            return bad_input("line " + std::to_string(sample.numbers[i]) + ": it is not clear whether the comma of " +
                                 printable_in_quotes(unclear) +
                                 " is a decimal sign; export the table with decimal points, or with semicolons "
                                 "between the columns",
                             static_cast<std::size_t>(unclear.data() - text.data()));
    const bool has_commas = some_have(',');
    if (some_have(';'))
        return CellStyle{';', has_commas};
    const auto separates = [](std::string_view row) { return has(row, ',') && !has_decimal_commas(row); };
    if (std::any_of(sample.rows.begin(), sample.rows.end(), separates))
        return CellStyle{','};
    return CellStyle{are_separated_by_tabs(sample) ? '\t' : ' ', has_commas};
}

} // namespace pbm::build
