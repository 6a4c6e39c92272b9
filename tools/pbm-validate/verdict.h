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
    std::uint64_t bytes = 0; // of the file, if it was read
    std::string hash{};      // XXH3-128 of the bytes in hexadecimal digits; empty unless asked for
};

// The message, and the compared values in parentheses.
std::string message_of(const Finding &finding);
// "error hash.chunk at offset 91264, level 9 chunks, chunk 3: 5.6.4 the chunk was changed: ..."
std::string text_of(const Finding &finding);
// "and 7 more: 7 hash.chunk": the findings that were not kept; empty if all were.
std::string text_of_rest(const ValidationReport &report);

// Prints VALID or INVALID, one line per kept finding, then the number of other findings per code.
void print_text(std::ostream &out, const Verdict &verdict, ValidationLevel level);

// The document of report.schema.json, as text.
std::string report_as_json(const std::vector<Verdict> &verdicts, ValidationLevel level, int exit_code);
// The same as SARIF 2.1.0: files are artifacts, findings results, and files that were not read notifications.
std::string report_as_sarif(const std::vector<Verdict> &verdicts, ValidationLevel level, int exit_code);
// JUnit XML: each file is a test case of the level's class.
std::string report_as_junit(const std::vector<Verdict> &verdicts, ValidationLevel level);

// Lists the catalogue. The Markdown form is the table of docs/reference/validator-codes.md.
std::string codes_as_text(const std::vector<const CatalogueEntry *> &entries);
std::string codes_as_markdown();
std::string codes_as_json();

// Codes with the name, group or rule `word`, or all codes if it is empty.
std::vector<const CatalogueEntry *> codes_named(const std::string &word);
// Whether the run failed and not the file: such findings have no offset.
inline bool is_of_the_run(const CatalogueEntry &entry) { return entry.group() == "io" || entry.group() == "system"; }
// Whether the finding has an offset in the file.
inline bool is_placed(const Finding &finding) { return !is_of_the_run(*finding.entry); }

// Error message if `word` is no code or group, with the nearest one; else empty.
std::string unknown_code(const std::string &word);

} // namespace pbm::validate_program
