// Help of a program: pages by topic that fit a screen, and the man page.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>
#include <vector>

namespace pbm::command_line {

inline constexpr std::size_t kPageLines = 24, kPageColumns = 80;

struct OptionHelp {
    std::vector<std::string> names; // as typed: "-o", "--output"; "FILE" for a positional argument
    std::string value;              // "FILE", "N", "[=FILE]"; empty for a flag
    std::string text;
    std::string topic;                      // "Grid"; empty for a positional argument
    bool required = false, several = false; // positional arguments only
    std::vector<std::string> proposals{};   // values that shells complete beside those that `value` names

    bool is_positional() const { return topic.empty(); }
};

struct Example {
    std::string command, text;
};

// Contents of the help beyond the options.
struct Manual {
    std::vector<std::string> most_used{}; // long names on the first page; empty: the options with a short name
    std::vector<Example> examples{};
    std::string run_time_limits{}; // causes of exit code 4 beside memory; may be empty
    bool logs_steps = false;       // the program logs steps with -v and --log
};

struct ProgramHelp {
    std::string program, version;
    std::string summary, description; // one sentence; paragraphs separated by line feeds, may be empty
    std::vector<OptionHelp> options;
    Manual manual{};
};

// Topics in the order of their pages, in lower case with "-" for spaces. "General" comes last.
std::vector<std::string> help_topics(const ProgramHelp &help);

// `topic`: one of help_topics, "all" for one page, "man" for the man page, "" for the first page. The first page holds
// everything if that fits a screen, else the most used options, the topics and, if it fits, the description.
//
// errors  usage  no such topic; the message suggests the nearest one or lists all
Result<std::string> help_page(const ProgramHelp &help, std::string_view topic);

// roff with the man macros: NAME, SYNOPSIS, DESCRIPTION, OPTIONS by topic, EXIT STATUS, EXAMPLES, SEE ALSO.
std::string man_page(const ProgramHelp &help);

} // namespace pbm::command_line
