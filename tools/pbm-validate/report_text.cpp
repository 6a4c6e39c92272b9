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

std::string compared(const Finding &finding) {
    std::string text;
    if (!finding.expected.empty())
        text += "expected " + to_string(finding.expected);
    if (!finding.actual.empty())
        text += (text.empty() ? "found " : ", found ") + to_string(finding.actual);
    return text.empty() ? "" : " (" + text + ")";
}

void print_finding(std::ostream &out, const Finding &finding) {
    out << "  " << to_string(finding.entry->severity) << ' ' << finding.entry->name;
    if (is_placed(finding))
        out << " at offset " << finding.offset;
    out << ", " << finding.section;
    if (finding.chunk >= 0)
        out << ", chunk " << finding.chunk;
    if (finding.tile >= 0)
        out << ", tile " << finding.tile;
    out << ": " << command_line::printable(finding.message + compared(finding)) << '\n';
}

// Prints the number of findings per code that were not kept.
void print_rest(std::ostream &out, const ValidationReport &report) {
    if (report.total == report.findings.size())
        return;
    std::string codes;
    for (std::size_t code = 0; code < report.totals.size(); ++code) {
        const auto kept = std::count_if(report.findings.begin(), report.findings.end(),
                                        [&](const Finding &finding) { return finding.entry == &kCatalogue[code]; });
        const std::uint64_t more = report.totals[code] - static_cast<std::uint64_t>(kept);
        if (more != 0)
            codes += (codes.empty() ? "" : ", ") + std::to_string(more) + " " + std::string(kCatalogue[code].name);
    }
    out << "  and " << report.total - report.findings.size() << " more: " << codes << '\n';
}

} // namespace

void print_text(std::ostream &out, const Verdict &verdict, ValidationLevel level) {
    const ValidationReport &report = verdict.report;
    const std::string found = summary(report), path = command_line::printable(verdict.path);
    if (!verdict.was_read) {
        out << "SKIPPED " << path << ignored(report) << '\n';
        return;
    }
    if (!verdict.valid)
        out << "INVALID " << path << ": " << found << ignored(report) << '\n';
    else if (level == ValidationLevel::quick)
        out << "VALID " << path << ": header and section table" << (found.empty() ? "" : "; " + found)
            << ignored(report) << '\n';
    else
        out << "VALID " << path << ": " << report.points << " points in " << report.chunks << " chunks"
            << (found.empty() ? "" : "; " + found) << ignored(report) << '\n';
    for (const Finding &finding : report.findings)
        print_finding(out, finding);
    print_rest(out, report);
}

} // namespace pbm::validate_program
