#include "verdict.h"

#include "command_line/command_line.h"

#include <algorithm>
#include <ostream>

namespace pbm::validate_program {

namespace {

std::string counted(std::uint64_t count, const std::string &what) {
    return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

// "2 errors, 1 warning"
std::string summary(const ValidationReport &report) {
    std::string text;
    const auto add = [&](std::uint64_t count, const char *what) {
        if (count != 0)
            text += (text.empty() ? "" : ", ") + counted(count, what);
    };
    add(report.errors, "error");
    add(report.warnings, "warning");
    add(report.infos, "info");
    return text;
}

// "; 2 findings ignored"
std::string ignored(const ValidationReport &report) {
    return report.ignored == 0 ? "" : "; " + counted(report.ignored, "finding") + " ignored";
}

// Whether the validator itself gave up, before it found anything wrong with the file.
bool is_undecided(const ValidationReport &report) {
    return report.errors > 0 && std::all_of(report.findings.begin(), report.findings.end(), [](const Finding &finding) {
               return finding.entry->severity != Severity::error || finding.entry->group() == "system";
           });
}

std::string compared(const Finding &finding) {
    std::string text;
    if (!finding.expected.empty())
        text += "expected " + to_string(finding.expected);
    if (!finding.actual.empty())
        text += (text.empty() ? "found " : ", found ") + to_string(finding.actual);
    return text.empty() ? "" : " (" + text + ")";
}

} // namespace

std::string message_of(const Finding &finding) { return finding.message + compared(finding); }

std::string text_of(const Finding &finding) {
    std::string text = std::string(to_string(finding.entry->severity)) + " " + std::string(finding.entry->name);
    if (is_placed(finding))
        text += " at offset " + std::to_string(finding.offset);
    text += ", " + finding.section;
    if (finding.chunk >= 0)
        text += ", chunk " + std::to_string(finding.chunk);
    if (finding.tile >= 0)
        text += ", tile " + std::to_string(finding.tile);
    return text + ": " + command_line::printable(message_of(finding));
}

std::string text_of_rest(const ValidationReport &report) {
    if (report.total == report.findings.size())
        return {};
    std::string codes;
    for (std::size_t code = 0; code < report.totals.size(); ++code) {
        const auto kept = std::count_if(report.findings.begin(), report.findings.end(),
                                        [&](const Finding &finding) { return finding.entry == &kCatalogue[code]; });
        const std::uint64_t more = report.totals[code] - static_cast<std::uint64_t>(kept);
        if (more != 0)
            codes += (codes.empty() ? "" : ", ") + std::to_string(more) + " " + std::string(kCatalogue[code].name);
    }
    return "and " + std::to_string(report.total - report.findings.size()) + " more: " + codes;
}

void print_text(std::ostream &out, const Verdict &verdict, ValidationLevel level) {
    const ValidationReport &report = verdict.report;
    const std::string found = summary(report), path = command_line::printable(verdict.path);
    if (!verdict.was_read) {
        out << "SKIPPED " << path << ignored(report) << '\n';
        return;
    }
    if (!verdict.valid)
        out << (is_undecided(report) ? "UNDECIDED " : "INVALID ") << path << ": " << found << ignored(report) << '\n';
    else if (level == ValidationLevel::quick)
        out << "VALID " << path << ": header and section table" << (found.empty() ? "" : "; " + found)
            << ignored(report) << '\n';
    else
        out << "VALID " << path << ": " << report.points << " points in " << report.chunks << " chunks"
            << (found.empty() ? "" : "; " + found) << ignored(report) << '\n';
    for (const Finding &finding : report.findings)
        out << "  " << text_of(finding) << '\n';
    if (const std::string rest = text_of_rest(report); !rest.empty())
        out << "  " << rest << '\n';
}

} // namespace pbm::validate_program
