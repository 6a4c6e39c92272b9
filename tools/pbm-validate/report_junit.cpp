// Verdicts as JUnit XML, which CI services show as tests.
#include "verdict.h"

#include "command_line/command_line.h"

namespace pbm::validate_program {

namespace {

std::string lines_of(const ValidationReport &report) {
    std::string lines;
    for (const Finding &finding : report.findings)
        lines += command_line::markup(text_of(finding)) + "\n";
    if (const std::string rest = text_of_rest(report); !rest.empty())
        lines += command_line::markup(rest) + "\n";
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
    return "      <" + element + " type=\"" + command_line::markup(type) + "\" message=\"" +
           command_line::markup(message) + "\">" + lines + "</" + element + ">\n";
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
                 command_line::markup(verdict.path) + "\"" +
                 (outcome.empty() ? "/>\n" : ">\n" + outcome + "    </testcase>\n");
    }
    const std::string counts = "tests=\"" + std::to_string(verdicts.size()) + "\" failures=\"" +
                               std::to_string(failures) + "\" errors=\"" + std::to_string(errors) + "\"";
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites " + counts +
           ">\n  <testsuite name=\"pbm-validate\" " + counts + ">\n" + cases + "  </testsuite>\n</testsuites>\n";
}

} // namespace pbm::validate_program
