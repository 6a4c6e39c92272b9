#include "verdict.h"

#include "command_line/spelling.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>
#include <sstream>

namespace pbm::validate_program {

namespace {

// Exit code for a file with only this fault.
int exit_code_of(const CatalogueEntry &entry) { return entry.severity == Severity::error ? exit_code(entry.kind) : 0; }

std::string padded(std::string_view text, std::size_t width) {
    return std::string(text) + std::string(width > text.size() ? width - text.size() : 0, ' ');
}

// "2.9, 2.10"
std::string rules_of(const CatalogueEntry &entry) {
    std::string list;
    for (const char c : entry.rules)
        list += c == ' ' ? std::string(", ") : std::string(1, c);
    return list;
}

} // namespace

std::string codes_as_text(const std::vector<const CatalogueEntry *> &entries) {
    std::string text;
    for (const CatalogueEntry *entry : entries) {
        text += padded(entry->name, 27) + padded(to_string(entry->severity), 9) + "exit code " +
                std::to_string(exit_code_of(*entry));
        text += (entry->rules.empty() ? "" : "  rules " + rules_of(*entry)) + "\n";
        text += "    " + std::string(entry->meaning) + "\n    " + std::string(entry->remedy) + "\n";
    }
    return text;
}

std::string codes_as_markdown() {
    std::string text = "| code | severity | exit | rules | meaning | what to do |\n|---|---|---|---|---|---|\n";
    for (const CatalogueEntry &entry : kCatalogue)
        text += "| `" + std::string(entry.name) + "` | " + std::string(to_string(entry.severity)) + " | " +
                std::to_string(exit_code_of(entry)) + " | " + rules_of(entry) + " | " + std::string(entry.meaning) +
                " | " + std::string(entry.remedy) + " |\n";
    return text;
}

std::string codes_as_json() {
    nlohmann::json codes = nlohmann::json::array();
    for (const CatalogueEntry &entry : kCatalogue) {
        std::istringstream rules{std::string(entry.rules)};
        codes.push_back({{"code", entry.name},
                         {"group", entry.group()},
                         {"severity", to_string(entry.severity)},
                         {"kind", to_string(entry.kind)},
                         {"exit_code", exit_code_of(entry)},
                         {"rules", std::vector<std::string>(std::istream_iterator<std::string>(rules), {})},
                         {"meaning", entry.meaning},
                         {"remedy", entry.remedy}});
    }
    return nlohmann::json{{"codes", std::move(codes)}}.dump(2) + "\n";
}

// Whether the entry stands for a rule of this section of BVG.md: 5.6.1 of 5.6.
bool holds_rule_of(const CatalogueEntry &entry, const std::string &section) {
    const std::string rules = " " + std::string(entry.rules);
    return rules.find(" " + section + ".") != std::string::npos;
}

std::vector<const CatalogueEntry *> codes_named(const std::string &word) {
    std::vector<const CatalogueEntry *> named;
    for (const CatalogueEntry &entry : kCatalogue)
        if (word.empty() || entry.name == word || entry.group() == word || entry.stands_for(word) ||
            holds_rule_of(entry, word))
            named.push_back(&entry);
    return named;
}

std::string unknown_code(const std::string &word) {
    std::vector<std::string> known;
    for (const CatalogueEntry &entry : kCatalogue)
        for (const std::string_view name : {entry.name, entry.group()})
            known.emplace_back(name);
    if (std::find(known.begin(), known.end(), word) != known.end())
        return {};
    const std::string nearest = command_line::nearest_word(word, known);
    return "'" + word + "' is no code" +
           (nearest.empty() ? "; --list-codes names them all" : "; did you mean " + nearest + "?");
}

} // namespace pbm::validate_program
