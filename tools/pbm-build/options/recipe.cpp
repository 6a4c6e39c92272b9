#include "recipe.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/encoding.h"
#include "pbm_scan/text/text_number.h"
#include "system/files/mapped_file.h"

#include <toml++/toml.h>

#include <algorithm>

namespace pbm::build {
namespace {

using command_line::Setting;

constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
constexpr int kMaxDots = 8;            // of one key: keys of recipes have none
constexpr std::size_t kMaxTables = 64; // of lights or materials; a model holds 8. Reading more takes quadratic time

Error refuse(std::size_t line, const std::string &what) {
    return usage_error("line " + std::to_string(line) + ": " + what);
}

// The line of a key with more than kMaxDots dots, a.b.c, if there is one. The TOML library would nest as many tables
// and overflow its stack. Strings and comments are skipped; an unfinished string ends the search.
std::optional<std::size_t> line_of_deep_key(std::string_view text) {
    std::size_t line = 1;
    int dots = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"' || c == '\'') {
            const std::string_view quotes =
                text.substr(i).starts_with(std::string(3, c)) ? text.substr(i, 3) : text.substr(i, 1);
            std::size_t end = i + quotes.size();
            while (end < text.size() && !text.substr(end).starts_with(quotes))
                end += c == '"' && text[end] == '\\' ? 2 : 1;
            end = std::min(end, text.size());
            line += static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                                        text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
            end = std::min(end + quotes.size(), text.size());
            for (int more = 0; quotes.size() == 3 && more < 2 && end < text.size() && text[end] == c; ++more)
                ++end; // a string may end with two quotes of its own
            i = end - 1;
        } else if (c == '#') {
            i = std::min(text.find('\n', i), text.size()) - 1;
        } else if (c == '.' && ++dots > kMaxDots) {
            return line;
        } else if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) {
            dots = 0;
            line += c == '\n' ? 1 : 0;
        }
    }
    return std::nullopt;
}

struct Value {
    Setting::Kind kind;
    std::string text;
};

std::optional<Value> value_of(const toml::node &node) {
    using Kind = Setting::Kind;
    if (const auto *text = node.as_string())
        return Value{Kind::text, text->get()};
    if (const auto *number = node.as_integer())
        return Value{Kind::number, shortest_text(number->get())};
    if (const auto *number = node.as_floating_point())
        return Value{Kind::number, shortest_text(number->get())};
    if (const auto *flag = node.as_boolean())
        return Value{Kind::flag, flag->get() ? "true" : "false"};
    return std::nullopt;
}

Result<Setting> setting_of(std::string key, const toml::node &node) {
    Setting entry{
        .key = std::move(key), .kind = {}, .values = {}, .is_array = node.is_array(), .line = node.source().begin.line};
    const auto add = [&](const toml::node &item) {
        const auto value = value_of(item);
        if (!value || (!entry.values.empty() && value->kind != entry.kind))
            return false;
        entry.kind = value->kind;
        entry.values.push_back(value->text);
        return true;
    };
    if (node.is_table())
        return refuse(entry.line, "'" + entry.key +
                                      "' is a table; write options alone, like depth = 9, and lights and materials as "
                                      "[[light]] and [[material]]");
    bool good = true;
    if (const toml::array *items = node.as_array())
        for (const toml::node &item : *items)
            good = good && add(item);
    else
        good = add(node);
    if (!good)
        return refuse(entry.line,
                      "'" + entry.key + "' is neither a string, a number, true, false nor an array of one of them");
    return entry;
}

// Converts a table of a light or material to the text of its option: its kind or name, then key=value between commas.
Result<Setting> setting_of_table(const std::string &option, const toml::table &table) {
    Setting entry{.key = option,
                  .kind = Setting::Kind::text,
                  .values = {""},
                  .is_array = false,
                  .line = table.source().begin.line};
    std::string word;
    std::string fields;
    std::size_t line_of_word = 0;
    for (const auto &[name, node] : table) {
        const std::string key(name.str());
        Result<Setting> field = setting_of(key, node);
        if (!field)
            return field.error();
        const bool flag = field->kind == Setting::Kind::flag;
        std::string value;
        for (const std::string &part : field->values)
            (value += value.empty() ? "" : ",") += flag ? (part == "true" ? "on" : "off") : part;
        if (key.find_first_of("=,") != std::string::npos || value.find('=') != std::string::npos)
            return refuse(field->line, "'" + key + "' and its value hold no = and no comma");
        if (key == "kind" || key == "name") {
            word = value;
            line_of_word = field->line;
        } else {
            ((fields += ',') += key) += '=' + value;
            entry.lines_of_keys.emplace_back(": " + key + ": ", field->line);
        }
    }
    if (line_of_word != 0)
        entry.lines_of_keys.emplace_back(" is no ", line_of_word); // kind, material or key=value
    entry.values.front() = word.empty() && !fields.empty() ? fields.substr(1) : word + fields;
    return entry;
}

// The tables of [[light]] and [[material]]; null for other keys.
const toml::array *tables_of(const std::string &key, const toml::node &node) {
    const bool known = key == "light" || key == "material";
    return known && node.is_array_of_tables() ? node.as_array() : nullptr;
}

} // namespace

Result<std::vector<Setting>> read_recipe(const std::string &path) {
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        return file.error();
    if (file->bytes().size() > kMaxBytes)
        return usage_error("larger than 1 MiB: this is no recipe");
    const auto utf8 = as_utf8(file->bytes());
    if (!utf8)
        return usage_error(utf8.error().message);
    const std::string_view text(reinterpret_cast<const char *>(utf8->bytes.data()), utf8->bytes.size());
    if (const auto line = line_of_deep_key(text))
        return refuse(*line, "a key of more than " + std::to_string(kMaxDots) + " dots; keys of recipes have none");
    toml::table table;
    try {
        table = toml::parse(text);
    } catch (const toml::parse_error &error) {
        const toml::source_position at = error.source().begin;
        return refuse(at.line, "column " + std::to_string(at.column) + ": " + std::string(error.description()));
    }
    std::vector<Setting> entries;
    for (const auto &[name, node] : table) {
        const std::string key(name.str());
        std::vector<Result<Setting>> read;
        const toml::array *const tables = tables_of(key, node);
        if (tables != nullptr && tables->size() > kMaxTables)
            return refuse(node.source().begin.line, std::to_string(tables->size()) + " tables [[" + key +
                                                        "]]; at most " + std::to_string(kMaxTables) + " are read");
        if (tables != nullptr)
            for (const toml::node &item : *tables)
                read.push_back(setting_of_table(key, *item.as_table()));
        else
            read.push_back(setting_of(key, node));
        for (Result<Setting> &entry : read) {
            if (!entry)
                return entry.error();
            entries.push_back(std::move(*entry));
        }
    }
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Setting &a, const Setting &b) { return a.line < b.line; });
    return entries;
}

} // namespace pbm::build
