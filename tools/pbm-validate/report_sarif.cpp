// The report of --json as SARIF 2.1.0, for services that show findings of analysers. Every fact is the JSON report's.
#include "verdict.h"

#include "system/files/file_names.h"

#include <nlohmann/json.hpp>

#include <map>

namespace pbm::validate_program {

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

const char *level_of(const std::string &severity) {
    return severity == "error" ? "error" : severity == "warning" ? "warning" : "note";
}

json artifact_location(const std::string &path, std::size_t index) {
    json location{{"index", index}};
    if (path == "-")
        location["description"] = {{"text", "standard input"}};
    else
        location["uri"] = uri_of(path);
    return location;
}

// The paragraphs of BVG.md as links to its anchors; a URI of the document itself has to be absolute, and there is none.
std::string links_of(const json &rules) {
    std::string links;
    for (const std::string rule : rules)
        links.append(links.empty() ? "BVG.md [" : ", [").append(rule).append("](BVG.md#").append(rule).append(")");
    return links;
}

ordered_json descriptor_of(const json &code) {
    const std::string meaning = code["meaning"], remedy = code["remedy"], links = links_of(code["rules"]);
    return {{"id", code["code"]},
            {"shortDescription", {{"text", meaning}}},
            {"help",
             {{"text", meaning + " " + remedy},
              {"markdown", meaning + "\n\n" + remedy + (links.empty() ? "" : "\n\n" + links)}}},
            {"defaultConfiguration", {{"level", level_of(code["severity"])}}},
            {"properties", {{"kind", code["kind"]}, {"exit_code", code["exit_code"]}, {"rules", code["rules"]}}}};
}

// "level 9 chunks, chunk 3"
std::string place_of(const json &finding) {
    std::string place = finding["section"];
    for (const char *part : {"chunk", "tile"})
        if (finding.contains(part))
            place += std::string(", ") + part + " " + finding[part].dump();
    return place;
}

ordered_json location_of(const json &finding, const Verdict &verdict, std::size_t artifact) {
    ordered_json place{{"artifactLocation", artifact_location(verdict.path, artifact)}};
    if (finding.contains("offset")) {
        const std::uint64_t offset = finding["offset"];
        place["region"] = {{"byteOffset", offset}, {"byteLength", offset < verdict.bytes ? 1 : 0}};
    }
    return {{"physicalLocation", std::move(place)},
            {"logicalLocations", json::array({{{"fullyQualifiedName", place_of(finding)}}})}};
}

// The codes of the catalogue as descriptors, and where each stands among them.
struct Descriptors {
    ordered_json rules = ordered_json::array(), notifications = ordered_json::array();
    std::map<std::string, std::size_t> index;

    explicit Descriptors(const json &codes) {
        for (std::size_t i = 0; i < codes.size(); ++i) {
            ordered_json &list = is_of_the_run(kCatalogue[i]) ? notifications : rules;
            index[codes[i]["code"]] = list.size();
            list.push_back(descriptor_of(codes[i]));
        }
    }
};

} // namespace

std::string report_as_sarif(const std::vector<Verdict> &verdicts, ValidationLevel level, int exit_code) {
    const json report = json::parse(report_as_json(verdicts, level, exit_code));
    const json codes = json::parse(codes_as_json())["codes"];
    Descriptors descriptors(codes);
    ordered_json results = ordered_json::array(), notifications = results, artifacts = results;
    bool all_read = true;
    for (std::size_t i = 0; i < verdicts.size(); ++i) {
        const Verdict &verdict = verdicts[i];
        json file = report["files"][i];
        std::map<std::string, int> seen; // findings of one code at one place are counted
        for (std::size_t k = 0; k < verdict.report.findings.size(); ++k) {
            const json &finding = file["findings"][k];
            const std::string code = finding["code"], place = place_of(finding);
            const bool is_result = is_placed(verdict.report.findings[k]);
            all_read = all_read && is_result;
            ordered_json entry{{"message", {{"text", message_of(verdict.report.findings[k])}}},
                               {"level", level_of(finding["severity"])},
                               {"locations", ordered_json::array({location_of(finding, verdict, i)})},
                               {"properties", finding}};
            if (is_result) {
                entry["ruleId"] = code;
                entry["ruleIndex"] = descriptors.index.at(code);
                std::string what = code;
                what.append(" ").append(place);
                entry["partialFingerprints"] = {{"codeAndPlace/v1", what + " " + std::to_string(++seen[what])}};
                results.push_back(std::move(entry));
            } else {
                entry["descriptor"] = {{"id", code}, {"index", descriptors.index.at(code)}};
                notifications.push_back(std::move(entry));
            }
        }
        file.erase("findings");
        ordered_json artifact{{"location", artifact_location(verdict.path, i)}, {"properties", std::move(file)}};
        artifact["location"].erase("index");
        if (verdict.was_read)
            artifact["length"] = verdict.bytes;
        if (!verdict.hash.empty())
            artifact["hashes"] = {{"xxh128", verdict.hash}};
        artifacts.push_back(std::move(artifact));
    }
    const ordered_json driver{{"name", report["validator"]["program"]},
                              {"version", report["validator"]["version"]},
                              {"rules", std::move(descriptors.rules)},
                              {"notifications", std::move(descriptors.notifications)},
                              {"properties", {{"format", report["validator"]["format"]}}}};
    ordered_json invocation{{"executionSuccessful", all_read}, {"exitCode", exit_code}};
    if (!notifications.empty())
        invocation["toolExecutionNotifications"] = std::move(notifications);
    const ordered_json run{{"tool", {{"driver", driver}}},
                           {"invocations", ordered_json::array({invocation})},
                           {"artifacts", std::move(artifacts)},
                           {"results", std::move(results)},
                           {"properties", {{"level", report["level"]}, {"valid", report["valid"]}}}};
    const ordered_json document{
        {"$schema", "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"},
        {"version", "2.1.0"},
        {"runs", ordered_json::array({run})}};
    return document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

} // namespace pbm::validate_program
