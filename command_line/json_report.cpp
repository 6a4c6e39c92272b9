#include "command_line/json_report.h"

#include "command_line/command_line.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

namespace pbm::command_line {
namespace {

using nlohmann::ordered_json;

struct Report {
    std::string path;
    bool verified = false, written = false;
    std::optional<ordered_json> failure;
};

Report &the_report() {
    static Report report;
    return report;
}

ordered_json text_or_null(std::string_view text) { return text.empty() ? ordered_json() : ordered_json(text); }

// Whether a command line that was not understood may write to `path`: no scan and no model begins with a brace.
bool is_new_or_json(const std::string &path) {
    if (path.find('\0') != std::string::npos)
        return false;
    std::error_code unknown;
    return path == "-" || !std::filesystem::is_regular_file(path, unknown) || std::ifstream(path).peek() == '{';
}

} // namespace

void set_json_path(std::string path) { the_report().path = std::move(path); }

void forget_json() { the_report().path.clear(); }

void json_may_be_written() { the_report().verified = true; }

int write_json(std::string_view program, const std::string &path, std::string_view document) {
    the_report().written = true;
    const Status status = write_text(path, document);
    return status ? 0 : fail(program, output_name(path), status.error());
}

void note_failure(std::string_view file, const Error &error, const std::string &message) {
    if (Report &report = the_report(); !report.failure)
        report.failure = ordered_json{{"kind", to_string(error.code)},
                                      {"code", text_or_null(error.name)},
                                      {"rule", text_or_null(error.rule)},
                                      {"file", text_or_null(file)},
                                      {"offset", has_offset(error) ? ordered_json(error.offset) : ordered_json()},
                                      {"message", message}};
}

void write_failure(std::string_view program, int code) {
    const Report &report = the_report();
    if (report.path.empty() || report.written || !report.failure || !(report.verified || is_new_or_json(report.path)))
        return;
    const ordered_json document{{"program", program}, {"exit_code", code}, {"error", *report.failure}};
    write_json(program, report.path, document.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n");
}

} // namespace pbm::command_line
