// What pbm-validate found out about one file, and how it tells it.
#pragma once

#include "pbm_format/checking/validate.h"

#include <iosfwd>
#include <string>
#include <vector>

namespace pbm::validate_program {

struct Verdict {
    std::string path;
    ValidationReport report;
    bool was_read = true; // else there is no verdict: the system refused
    bool valid = true;
    int exit_code = 0;
};

// VALID or INVALID, then a line for each finding that is kept, then how many of which code are not.
void print_text(std::ostream &out, const Verdict &verdict, ValidationLevel level);

// The document of report.schema.json, as text.
std::string report_as_json(const std::vector<Verdict> &verdicts, ValidationLevel level, int exit_code);

// The catalogue. Markdown is the table of docs/reference/validator-codes.md.
std::string codes_as_text(const std::vector<const CatalogueEntry *> &entries);
std::string codes_as_markdown();
std::string codes_as_json();

// Codes that `word` names: a code, a group or a rule; empty if it names none.
std::vector<const CatalogueEntry *> codes_named(const std::string &word);
// Whether the finding has a place in the file.
inline bool is_placed(const Finding &finding) {
    return finding.entry->group() != "io" && finding.entry->group() != "system";
}

// What is wrong with `word` as a code or group, with the nearest one; empty if nothing is.
std::string unknown_code(const std::string &word);

} // namespace pbm::validate_program
