// Names of warnings on the command line: --deny, --allow, --list-warnings.
#pragma once

#include "pbm_scan/surface/attribute_report.h"

#include <string>
#include <vector>

namespace pbm::build {

// Complaint about a word that names no warning, else empty.
std::string unknown_warning(const std::string &word);
// Also about one that is found only when the output is there: what is denied refuses the scan before that.
std::string undeniable_warning(const std::string &word);

// Names of warnings, or of those alone that --deny takes.
std::vector<std::string> warning_names(bool only_deniable);

// `words` are names.
WarningSet warnings_named(const std::vector<std::string> &words);

// Prints all names to standard output. The Markdown form is the table of docs/reference/warnings.md.
void print_warnings(bool as_markdown);

} // namespace pbm::build
