#include "pbm_scan/table/cell_style.h"

#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::string_view kQuotes = "\"'";
constexpr std::size_t kHeadBytes = 65536; // that are looked at

// Whether a line has three numbers, whatever stands between them.
bool is_row(std::string_view line) {
    constexpr std::string_view kAround = " \t\r\v\f,;\"'";
    int numbers = 0;
    for (double value = 0; numbers < 3 && !line.empty();) {
        line.remove_prefix(std::min(line.find_first_not_of(kAround), line.size()));
        const std::string_view word = line.substr(0, line.find_first_of(kAround));
        if (word.starts_with('#') || word.starts_with("//"))
            return false;
        numbers += is_number(word, value) ? 1 : 0;
        line.remove_prefix(word.size());
    }
    return numbers == 3;
}

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    for (std::string_view word = take_word(text); !word.empty(); word = take_word(text))
        words.push_back(word);
    return words;
}

// Whether the commas of a row can be decimal signs.
bool has_decimal_commas(std::string_view row) {
    const std::vector<std::string_view> words = words_of(row);
    const auto fits = [](std::string_view word) {
        return std::count(word.begin(), word.end(), ',') <= 1 && word.front() != ',' && word.back() != ',';
    };
    return words.size() >= 3 && std::all_of(words.begin(), words.end(), fits);
}

// A number like "1,234.5" in a row, or nothing.
std::string_view number_of_two_signs(std::string_view row) {
    for (const std::string_view word : words_of(row))
        if (word.find(',') != std::string_view::npos && word.find('.') != std::string_view::npos)
            return word;
    return {};
}

// A number of a row like "1,5, 2,5, 3,5", or nothing.
std::string_view number_of_two_commas(std::string_view row) {
    const std::vector<std::string_view> words = words_of(row);
    for (std::size_t i = 0; i < words.size(); ++i) {
        const std::string_view inner = trimmed(words[i], ",");
        if (std::count(inner.begin(), inner.end(), ',') != 1 || words[i].find('.') != std::string_view::npos ||
            (words[i].back() == ',') == (i + 1 == words.size()))
            return {};
    }
    return words.size() < 3 ? std::string_view() : words.front();
}

// The first rows of a table, and the line in front of them.
struct Head {
    std::string_view header;
    std::vector<std::string_view> rows;
    std::vector<std::uint64_t> numbers; // of the lines of the rows
};

Head head_of(std::string_view text) {
    const bool is_cut = text.size() > kHeadBytes;
    Lines lines(text.substr(0, kHeadBytes));
    Head head;
    while (lines.next() && (lines.terminated() || !is_cut)) {
        const std::string_view line = lines.rest();
        if (trimmed(line, kBlanks).empty())
            continue;
        if (is_row(line)) {
            head.rows.push_back(line);
            head.numbers.push_back(lines.number());
        } else if (head.rows.empty()) {
            head.header = line;
        }
    }
    return head;
}

bool are_separated_by_tabs(const Head &head) {
    const auto cells = [](std::string_view row) { return text_cells(row, '\t'); };
    const auto has_empty = [](const std::vector<std::string> &all) {
        return std::find(all.begin(), all.end(), "") != all.end();
    };
    std::size_t count = 0;
    bool is_full = true;
    for (const std::string_view row : head.rows) {
        const std::vector<std::string> of_row = cells(row);
        const auto is_one_word = [](const std::string &cell) { return cell.find(' ') == std::string::npos; };
        if (!std::all_of(of_row.begin(), of_row.end(), is_one_word))
            return false;
        is_full = is_full && !has_empty(of_row) && (count == 0 || of_row.size() == count);
        count = of_row.size();
    }
    const std::vector<std::string> names = cells(trimmed(head.header, kBlanks));
    return count >= 3 && (is_full || (names.size() >= 3 && !has_empty(names)));
}

} // namespace

Result<CellStyle> find_cell_style(std::string_view text) {
    const Head head = head_of(text);
    const auto some = [&](const auto &is) { return std::any_of(head.rows.begin(), head.rows.end(), is); };
    const auto has = [](char c) { return [c](std::string_view row) { return row.find(c) != std::string_view::npos; }; };
    const bool has_commas = some(has(','));
    if (some(has(';')))
        return CellStyle{';', has_commas};
    const bool separates = some([&](std::string_view row) { return has(',')(row) && !has_decimal_commas(row); });
    for (std::size_t i = 0; has_commas && i < head.rows.size(); ++i) {
        const std::string_view unclear =
            separates ? number_of_two_commas(head.rows[i]) : number_of_two_signs(head.rows[i]);
        if (!unclear.empty())
            return bad_input("line " + std::to_string(head.numbers[i]) + ": it is not clear whether the comma of " +
                                 printable_in_quotes(unclear) +
                                 " is a decimal sign; export the table with decimal points, or with semicolons "
                                 "between the columns",
                             static_cast<std::size_t>(unclear.data() - text.data()));
    }
    if (separates)
        return CellStyle{','};
    return CellStyle{are_separated_by_tabs(head) ? '\t' : ' ', has_commas};
}

std::vector<std::string> text_cells(std::string_view line, char separator) {
    std::vector<std::string> cells;
    const auto is_blank = [&](char c) { return c != separator && ends_word(c); };
    const std::string_view ends = separator == ' ' ? kBlanks : std::string_view(&separator, 1);
    while (true) {
        while (!line.empty() && (is_blank(line.front()) || (separator == ' ' && ends_word(line.front()))))
            line.remove_prefix(1);
        if (line.empty() && (separator == ' ' || cells.empty()))
            return cells;
        std::size_t end = std::string_view::npos;
        if (!line.empty() && kQuotes.find(line.front()) != std::string_view::npos)
            end = line.find(line.front(), 1);
        end = line.find_first_of(ends, end == std::string_view::npos ? 0 : end);
        cells.emplace_back(trimmed(trimmed(line.substr(0, end), kBlanks), kQuotes));
        if (end == std::string_view::npos)
            return cells;
        line.remove_prefix(end + 1);
    }
}

} // namespace pbm::build
