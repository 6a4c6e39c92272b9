#include "warning_options.h"

#include "command_line/spelling.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/text/printable.h"

#include <iostream>

namespace pbm::build {

std::string unknown_warning(const std::string &word) {
    if (!word.empty() && find_warning(word) != Warning::none)
        return {};
    const std::string nearest = command_line::nearest_word(word, warning_names(false));
    return "'" + word + "' is no warning" +
           (nearest.empty() ? "; --list-warnings names them all" : "; did you mean " + nearest + "?");
}

std::string undeniable_warning(const std::string &word) {
    std::string complaint = unknown_warning(word);
    if (complaint.empty() && !entry_of(find_warning(word)).is_deniable)
        complaint = word + " is found when the output is there: --deny cannot refuse it";
    return complaint;
}

std::vector<std::string> warning_names(bool only_deniable) {
    std::vector<std::string> names;
    for (const WarningEntry &entry : kWarnings)
        if (!entry.name.empty() && (entry.is_deniable || !only_deniable))
            names.emplace_back(entry.name);
    return names;
}

WarningSet warnings_named(const std::vector<std::string> &words) {
    WarningSet set;
    for (const std::string &word : words)
        set.set(static_cast<std::size_t>(find_warning(word)));
    return set;
}

void print_warnings(bool as_markdown) {
    if (as_markdown)
        std::cout << "| name | fate | meaning | what to do |\n|---|---|---|---|\n";
    for (const WarningEntry &entry : kWarnings)
        if (as_markdown && !entry.name.empty())
            std::cout << "| `" << entry.name << "` | " << to_string(entry.fate) << " | " << entry.help << " | "
                      << entry.remedy << " |\n";
        else if (!entry.name.empty())
            std::cout << formatted("%-20s %-10s ", entry.name.data(), to_string(entry.fate).data()) << entry.help << ' '
                      << entry.remedy << '\n';
}

} // namespace pbm::build
