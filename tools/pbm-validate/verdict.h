// The verdict of pbm-validate on one file, and its output.
#pragma once

#include "pbm_format/checking/validate.h"

#include <iosfwd>
#include <string>
#include <vector>

namespace pbm::validate_program {

struct Verdict {
    std::string path;
    ValidationReport report;
    bool was_read = true; // false: no verdict, since the system refused to read
    bool valid = true;
    int exit_code = 0;
};

// Prints VALID or INVALID, one line per kept finding, then the number of other findings per code.
void print_text(std::ostream &out, const Verdict &verdict, ValidationLevel level);

// The document of report.schema.json, as text.
std::string report_as_json(const std::vector<Verdict> &verdicts, ValidationLevel level, int exit_code);

// Lists the catalogue. The Markdown form is the table of docs/reference/validator-codes.md.
std::string codes_as_text(const std::vector<const CatalogueEntry *> &entries);
std::string codes_as_markdown();
std::string codes_as_json();

// Codes with the name, group or rule `word`, or all codes if it is empty.
std::vector<const CatalogueEntry *> codes_named(const std::string &word);
// Whether the finding has an offset in the file.
inline bool is_placed(const Finding &finding) {
    return finding.entry->group() != "io" && finding.entry->group() != "system";
}

// Error message if `word` is no code or group, with the nearest one; else empty.
std::string unknown_code(const std::string &word);

} // namespace pbm::validate_program
