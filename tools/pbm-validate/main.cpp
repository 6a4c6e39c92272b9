// pbm-validate: is this .bvg valid, and if not, what breaks which rule where.
#include "command_line/common_options.h"
#include "pbm_format/platform.h"
#include "pbm_format/validate.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iostream>

namespace {

using nlohmann::json;

struct Verdict {
    std::string path;
    pbm::ValidationReport report;
    int exit_code = 0;
};

// Exit code of the gravest finding: an unknown version or feature outranks damage, which outranks I/O.
int exit_code_of(const pbm::ValidationReport &report) {
    int code = 0;
    for (const pbm::Finding &finding : report.findings)
        code = std::max(code, pbm::exit_code(finding.code));
    return code;
}

Verdict examine(const std::string &path, const pbm::ValidateOptions &options) {
    Verdict verdict{.path = path, .report = {}, .exit_code = 0};
    const pbm::Result<pbm::MappedFile> file = pbm::MappedFile::open(path);
    if (file) {
        verdict.report = pbm::validate(file->bytes(), options);
    } else {
        verdict.report.total = 1;
        verdict.report.findings.push_back(
            {.code = file.error().code, .offset = 0, .section = "file", .chunk = -1, .message = file.error().message});
    }
    verdict.exit_code = exit_code_of(verdict.report);
    return verdict;
}

void print_text(const Verdict &verdict, bool quiet) {
    const pbm::ValidationReport &report = verdict.report;
    if (verdict.exit_code == pbm::exit_code(pbm::ErrorCode::io)) { // no verdict: the file was not read
        pbm::command_line::fail("pbm-validate", verdict.path, {pbm::ErrorCode::io, 0, report.findings[0].message});
        return;
    }
    if (report.valid()) {
        if (!quiet)
            std::cout << "VALID " << pbm::command_line::printable(verdict.path) << ": " << report.points
                      << " points in " << report.chunks << " chunks\n";
        return;
    }
    std::cout << "INVALID " << pbm::command_line::printable(verdict.path) << ": " << report.total
              << (report.total == 1 ? " fault\n" : " faults\n");
    for (const pbm::Finding &finding : report.findings) {
        std::cout << "  " << pbm::to_string(finding.code) << " at offset " << finding.offset << ", " << finding.section;
        if (finding.chunk >= 0)
            std::cout << ", chunk " << finding.chunk;
        std::cout << ": " << finding.message << '\n';
    }
    if (report.total > report.findings.size())
        std::cout << "  and " << report.total - report.findings.size() << " more\n";
}

json to_json(const Verdict &verdict) {
    json findings = json::array();
    for (const pbm::Finding &finding : verdict.report.findings) {
        json entry{{"code", pbm::to_string(finding.code)},
                   {"offset", finding.offset},
                   {"section", finding.section},
                   {"message", finding.message}};
        if (finding.chunk >= 0)
            entry["chunk"] = finding.chunk;
        findings.push_back(std::move(entry));
    }
    return {{"file", verdict.path},
            {"valid", verdict.report.valid()},
            {"exit_code", verdict.exit_code},
            {"points", verdict.report.points},
            {"chunks", verdict.report.chunks},
            {"faults", verdict.report.total},
            {"findings", std::move(findings)}};
}

int run(int argc, char **argv) {
    CLI::App app{"Says whether binary voxel grids (.bvg) are valid, and if not, what breaks which rule where.\n"
                 "The rules are those of BVG.md. Of several files the highest exit code counts.",
                 "pbm-validate"};
    std::vector<std::string> paths;
    std::string json_path;
    pbm::ValidateOptions options;
    bool quiet = false;
    app.add_option("FILE", paths, "Models to examine")->required();
    pbm::command_line::add_json(app, json_path, "Verdicts");
    pbm::command_line::add_threads(app, options.threads);
    app.add_option("--max-findings", options.max_findings, "Findings to print per file")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    app.add_flag("-q,--quiet", quiet, "Say nothing about valid files");
    app.set_version_flag("-V,--version", "pbm-validate " PBM_VERSION);
    if (const auto done = pbm::command_line::parse(
            app, "pbm-validate", argc, argv, {},
            {.examples = {{"pbm-validate -q *.bvg", "Names the files that are not valid, and nothing else."}}}))
        return *done;

    if (const auto refused = pbm::command_line::refuse_outputs("pbm-validate", paths, {{json_path}}))
        return *refused;
    int code = 0;
    json verdicts = json::array();
    for (const std::string &path : paths) {
        pbm::command_line::work_on(path);
        const Verdict verdict = examine(path, options);
        code = std::max(code, verdict.exit_code);
        if (!json_path.empty())
            verdicts.push_back(to_json(verdict));
        else
            print_text(verdict, quiet);
    }
    if (!json_path.empty()) {
        const std::string text = verdicts.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
        if (const pbm::Status status = pbm::command_line::write_text(json_path, text); !status)
            return pbm::command_line::fail("pbm-validate", json_path, status.error());
    }
    return code;
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program("pbm-validate", [&] { return run(argc, argv); });
}
