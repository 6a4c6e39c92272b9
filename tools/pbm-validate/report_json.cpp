#include "verdict.h"

#include "pbm_format/container/layout.h"

#include <nlohmann/json.hpp>

namespace pbm::validate_program {

namespace {

using nlohmann::json;

json as_json(const Value &value) {
    return std::visit(
        [&](const auto &held) -> json {
            using Held = std::decay_t<decltype(held)>;
            if constexpr (std::is_same_v<Held, std::monostate>)
                return nullptr;
            else if constexpr (std::is_same_v<Held, Value::Hash>)
                return to_string(value);
            else
                return held;
        },
        value.held());
}

json finding_object(const Finding &finding) {
    json object{{"code", finding.entry->name},     {"severity", to_string(finding.entry->severity)},
                {"kind", to_string(finding.code)}, {"section", finding.section},
                {"message", finding.message},      {"remedy", finding.entry->remedy}};
    if (!finding.rule.empty())
        object["rule"] = finding.rule;
    if (is_placed(finding))
        object["offset"] = finding.offset;
    if (finding.chunk >= 0)
        object["chunk"] = finding.chunk;
    if (finding.tile >= 0)
        object["tile"] = finding.tile;
    if (!finding.expected.empty())
        object["expected"] = as_json(finding.expected);
    if (!finding.actual.empty())
        object["actual"] = as_json(finding.actual);
    return object;
}

json file_object(const Verdict &verdict) {
    const ValidationReport &report = verdict.report;
    json findings = json::array(), totals = json::object();
    for (const Finding &finding : report.findings)
        findings.push_back(finding_object(finding));
    for (std::size_t code = 0; code < report.totals.size(); ++code)
        if (report.totals[code] != 0)
            totals[std::string(kCatalogue[code].name)] = report.totals[code];
    return {{"file", verdict.path},        {"valid", verdict.valid},         {"exit_code", verdict.exit_code},
            {"points", report.points},     {"chunks", report.chunks},        {"errors", report.errors},
            {"warnings", report.warnings}, {"infos", report.infos},          {"ignored", report.ignored},
            {"totals", std::move(totals)}, {"findings", std::move(findings)}};
}

} // namespace

std::string report_as_json(const std::vector<Verdict> &verdicts, ValidationLevel level, int exit_code) {
    json files = json::array();
    bool valid = true;
    for (const Verdict &verdict : verdicts) {
        files.push_back(file_object(verdict));
        valid = valid && verdict.valid;
    }
    const json document{{"validator",
                         {{"program", "pbm-validate"},
                          {"version", PBM_VERSION},
                          {"format", std::to_string(kMajorVersion) + "." + std::to_string(kMinorVersion)}}},
                        {"level", to_string(level)},
                        {"valid", valid},
                        {"exit_code", exit_code},
                        {"files", std::move(files)}};
    return document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

} // namespace pbm::validate_program
