// Help of a program: pages by topic that fit a screen, and its man page.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>
#include <vector>

namespace pbm::command_line {

inline constexpr std::size_t kPageLines = 24, kPageColumns = 80;

struct OptionHelp {
    std::vector<std::string> names; // as they are typed: "-o", "--output"; of what needs no name: "FILE"
    std::string value;              // "FILE", "N", "[=FILE]"; empty for a flag
    std::string text;
    std::string topic; // "Grid"; options with a name only
    bool needs_name = true;
    bool required = false, several = false; // what needs no name

    bool has_short_name() const;
};

struct Example {
    std::string command, text;
};

struct ProgramHelp {
    std::string program, version;
    std::string summary, description; // one sentence; paragraphs between line feeds, may be empty
    std::vector<OptionHelp> options;
    std::vector<std::string> most_used; // names; empty: those with a short name
    std::vector<Example> examples;
    std::string run_time_limits{}; // what ends with exit code 4 beside memory; may be empty
};

// Names of the topics in the order of their pages: lower case, "-" for spaces. "General" comes last.
std::vector<std::string> help_topics(const ProgramHelp &help);

// `topic`: one of help_topics; "" for the first page, which tells everything if that fits a screen, else the options
// used most, the topics and, where there is room, the description; "all" for everything on one page; "man" for the man
// page.
//
// errors  usage  no such topic; the message names the nearest or all
Result<std::string> help_page(const ProgramHelp &help, std::string_view topic);

// roff with the man macros: NAME, SYNOPSIS, DESCRIPTION, OPTIONS by topic, EXIT STATUS, EXAMPLES, SEE ALSO.
std::string man_page(const ProgramHelp &help);

} // namespace pbm::command_line
