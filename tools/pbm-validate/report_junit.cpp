// Verdicts as JUnit XML, which CI services show as tests.
#include "verdict.h"

#include "command_line/command_line.h"
#include "system/utf8.h"

namespace pbm::validate_program {

namespace {

// Text of an attribute or element: no control characters, UTF-8 alone, and XML's own characters escaped.
std::string xml(std::string_view text) {
    const std::string line = command_line::printable(text);
    std::string out;
    for (std::string_view left = line; !left.empty();) {
        const Utf8Character character = utf8_character(left);
        const std::string_view bytes = left.substr(0, std::max<std::size_t>(character.bytes, 1));
        left.remove_prefix(bytes.size());
        const bool is_none = character.bytes == 0 || character.code == 0xFFFE || character.code == 0xFFFF;
        out += is_none         ? "\xEF\xBF\xBD"
               : bytes == "&"  ? "&amp;"
               : bytes == "<"  ? "&lt;"
               : bytes == ">"  ? "&gt;"
               : bytes == "\"" ? "&quot;"
                               : bytes;
    }
    return out;
}

std::string lines_of(const ValidationReport &report) {
    std::string lines;
    for (const Finding &finding : report.findings)
        lines += xml(text_of(finding)) + "\n";
    if (const std::string rest = text_of_rest(report); !rest.empty())
        lines += xml(rest) + "\n";
    return lines;
}

// The findings of a file: an error where it was not read, a failure where it is invalid, else output of the test.
std::string outcome_of(const Verdict &verdict) {
    const std::string lines = lines_of(verdict.report);
    if (verdict.valid)
        return lines.empty() ? "" : "      <system-out>" + lines + "</system-out>\n";
    const std::string element = verdict.was_read ? "failure" : "error";
    std::string type, message;
    if (const auto &findings = verdict.report.findings; !findings.empty()) {
        type = findings.front().entry->name;
        message = findings.front().message;
    }
    return "      <" + element + " type=\"" + xml(type) + "\" message=\"" + xml(message) + "\">" + lines + "</" +
           element + ">\n";
}

} // namespace

std::string report_as_junit(const std::vector<Verdict> &verdicts, ValidationLevel level) {
    std::size_t failures = 0, errors = 0;
    std::string cases;
    for (const Verdict &verdict : verdicts) {
        failures += !verdict.valid && verdict.was_read ? 1 : 0;
        errors += !verdict.valid && !verdict.was_read ? 1 : 0;
        const std::string outcome = outcome_of(verdict);
        cases += "    <testcase classname=\"pbm-validate." + std::string(to_string(level)) + "\" name=\"" +
                 xml(verdict.path) + "\"" + (outcome.empty() ? "/>\n" : ">\n" + outcome + "    </testcase>\n");
    }
    const std::string counts = "tests=\"" + std::to_string(verdicts.size()) + "\" failures=\"" +
                               std::to_string(failures) + "\" errors=\"" + std::to_string(errors) + "\"";
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites " + counts +
           ">\n  <testsuite name=\"pbm-validate\" " + counts + ">\n" + cases + "  </testsuite>\n</testsuites>\n";
}

} // namespace pbm::validate_program
