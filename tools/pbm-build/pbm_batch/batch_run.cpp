#include "pbm_batch/batch_run.h"

#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "command_line/json_report.h"
#include "pbm_batch/build_batch.h"
#include "pbm_batch/plan.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "system/files/descriptor.h"
#include "system/processes/usable_memory.h"
#include "system/threads/parallel.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iostream>
#include <system_error>
#include <utility>

namespace pbm::build {
namespace {

using Json = nlohmann::ordered_json;

// Of scans with the same outcome.
struct Totals {
    std::uint64_t scans = 0, points = 0, input_bytes = 0, output_bytes = 0;
    double seconds = 0; // of their builds

    void add(const batch::Ending &ending, const Json &document) {
        ++scans;
        points += document.value("points", std::uint64_t{0});
        input_bytes += ending.scan->bytes;
        output_bytes += document.value("file_bytes", std::uint64_t{0});
        seconds += ending.seconds;
    }
    Totals &operator+=(const Totals &other) {
        scans += other.scans;
        points += other.points;
        input_bytes += other.input_bytes;
        output_bytes += other.output_bytes;
        seconds += other.seconds;
        return *this;
    }
};

enum Row : std::size_t { kBuilt, kAsBefore, kCached, kFailed, kNotStarted, kRows };
constexpr std::array<const char *, kRows> kNames{"built", "as before", "from cache", "failed", "not started"};

std::string row_text(const char *name, const Totals &totals) {
    return formatted("%-12s %7llu %14llu %12.2f %12.2f %10.1f\n", name, static_cast<unsigned long long>(totals.scans),
                     static_cast<unsigned long long>(totals.points), static_cast<double>(totals.input_bytes) * 1e-6,
                     static_cast<double>(totals.output_bytes) * 1e-6, totals.seconds);
}

// "12 min" of seconds.
std::string duration_text(double seconds) {
    if (seconds < 90)
        return formatted("%.0f s", seconds);
    return seconds < 5400 ? formatted("%.0f min", seconds / 60) : formatted("%.1f h", seconds / 3600);
}

class BatchReport {
  public:
    BatchReport(std::string_view program, const Arguments &arguments, std::span<const batch::Scan> scans,
                std::ostream *out)
        : program_(program), arguments_(arguments), scans_(scans), out_(out),
          display_(arguments.verbosity, arguments.progress) {
        for (const batch::Scan &scan : scans)
            all_bytes_ += scan.bytes;
        if (arguments.json != "-" && !arguments.json.empty()) {
            std::error_code ignored; // it is not there, or is no regular file
            std::filesystem::resize_file(arguments.json, 0, ignored);
            json_file_ = open_to_append(arguments.json);
            json_error_ = json_file_.ok() ? 0 : errno;
        }
        show_progress();
    }

    // Of opening or writing the file of --json.
    Status json_status() const { return json_error_ == 0 ? Status() : io_error("cannot write", json_error_); }

    void add(const batch::Ending &ending) {
        display_.clear();
        ++ended_;
        bytes_ += ending.scan->bytes;
        Json document = Json::parse(ending.document, nullptr, false);
        if (!document.is_object())
            document = Json::object();
        const std::string outcome = document.value("outcome", "");
        const bool is_built = outcome == to_string(Outcome::written);
        totals_[ending.exit_code != 0                   ? kFailed
                : is_built                              ? kBuilt
                : outcome == to_string(Outcome::cached) ? kCached
                                                        : kAsBefore]
            .add(ending, document);
        if (is_built || ending.exit_code != 0)
            worked_bytes_ += ending.scan->bytes;
        write_json(ending, document);
        if (ending.exit_code != 0)
            say_failure(ending);
        else
            say_built(ending, document, is_built);
        if (!ending.warning.empty() && !std::exchange(has_warned_, true)) // the others say the same: of the cache
            command_line::warn(program_, without(ending.warning, {std::string(program_) + ": warning: "}));
        show_progress();
    }

    // A line of JSON for what no scan of the batch is.
    void add_rest(std::span<const batch::LeftOut> left_out, std::span<const std::string> stale) {
        if (left_out.empty() && stale.empty())
            return;
        Json line{{"left_out", Json::array()}, {"stale_models", stale}};
        for (const batch::LeftOut &each : left_out)
            line["left_out"].push_back({{"path", each.path}, {"kind", each.kind}});
        write_line(line);
    }

    // The table, and the exit code.
    int finish() {
        display_.clear();
        for (const batch::Scan &scan : scans_.subspan(std::min(ended_, scans_.size()))) // not started: the last ones
            totals_[kNotStarted].input_bytes += scan.bytes;
        totals_[kNotStarted].scans = scans_.size() - ended_;
        if (says_normal()) {
            *out_ << "\n                scans         points     input MB    output MB    seconds\n";
            Totals all;
            for (std::size_t row = 0; row < kRows; ++row) {
                if (totals_[row].scans != 0)
                    *out_ << row_text(kNames[row], totals_[row]);
                all += totals_[row];
            }
            *out_ << row_text("all", all) << formatted("%s on the clock\n", duration_text(elapsed()).c_str())
                  << std::flush;
        }
        if (totals_[kNotStarted].scans != 0)
            std::cerr << program_ << ": " << counted(totals_[kNotStarted].scans, "scan")
                      << " not started after this failure; --keep-going builds them all the same\n";
        if (const Status written = json_status(); !written)
            return command_line::fail(program_, arguments_.json, written.error());
        return exit_code_;
    }

  private:
    bool says_normal() const { return arguments_.verbosity >= command_line::Verbosity::normal && out_ != nullptr; }

    double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

    std::string count_text() const { return formatted("%zu/%zu ", ended_, scans_.size()); }

    static std::string without(std::string message, std::initializer_list<std::string> prefixes) {
        for (const std::string &prefix : prefixes)
            if (message.starts_with(prefix))
                message.erase(0, prefix.size());
        return message;
    }

    // What went wrong, without the names of program and scan.
    std::string message_of(const batch::Ending &ending) const {
        return without(ending.message, {std::string(program_) + ": ", ending.scan->input + ": "});
    }

    void say_failure(const batch::Ending &ending) {
        if (ending.scan < first_failed_) { // the first one of the list
            first_failed_ = ending.scan;
            exit_code_ = ending.exit_code;
        }
        const std::string line = ending.scan->input + ": " + message_of(ending);
        std::cerr << program_ << ": " << command_line::printable(line) << std::endl;
        command_line::log_line(command_line::LogKind::error, line);
    }

    void say_built(const batch::Ending &ending, const Json &document, bool is_built) {
        std::size_t dropped = 0;
        for (const Json &line : document.value("attributes", Json::array()))
            if (const std::string warning = line.value("warning", "");
                line.value("fate", "") == "dropped" && !contains(arguments_.allowed, find_warning(warning))) {
                ++dropped;
                const std::string text = ending.scan->input + ": " + line.value("name", "") + " dropped (" +
                                         line.value("note", "") + ") [" + warning + "]";
                command_line::log_line(command_line::LogKind::warning, text);
                if (arguments_.verbosity == command_line::Verbosity::warnings)
                    std::cerr << program_ << ": warning: " << command_line::printable(text) << '\n';
            }
        if (!says_normal())
            return;
        std::string text = count_text() + command_line::printable(ending.scan->name) +
                           formatted(": %llu points, depth %d, %.2f MB",
                                     static_cast<unsigned long long>(document.value("points", std::uint64_t{0})),
                                     document.value("depth", 0),
                                     static_cast<double>(document.value("file_bytes", std::uint64_t{0})) * 1e-6);
        if (!is_built)
            text += ", " + document.value("outcome", "");
        else if (dropped != 0)
            text += ", " + counted(dropped, "drop");
        *out_ << text << formatted(", %.2f s\n", ending.seconds) << std::flush;
    }

    void write_json(const batch::Ending &ending, const Json &document) {
        const Json line{{"scan", ending.scan->name},
                        {"input", ending.scan->input},
                        {"output", ending.scan->output},
                        {"exit_code", ending.exit_code},
                        {"seconds", ending.seconds},
                        {"message", message_of(ending)},
                        {"report", document.empty() ? Json() : document}};
        write_line(line);
    }

    void write_line(const Json &line) {
        if (arguments_.json.empty())
            return;
        const std::string text = line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
        if (arguments_.json == "-")
            std::cout << text << std::flush;
        else if (json_error_ == 0)
            json_error_ = write_all(json_file_.number(), as_bytes(text));
    }

    // The time that is left, by the bytes of scans that were built: those that are as before take hardly any.
    void show_progress() {
        std::string note = formatted("%zu of %zu scans", ended_, scans_.size());
        if (totals_[kFailed].scans != 0)
            note += formatted(", %llu failed", static_cast<unsigned long long>(totals_[kFailed].scans));
        constexpr double kMin = 5;
        if (worked_bytes_ != 0 && elapsed() > kMin && ended_ < scans_.size())
            note += ", about " +
                    duration_text(elapsed() * static_cast<double>(all_bytes_ - bytes_) /
                                  static_cast<double>(worked_bytes_)) +
                    " left";
        display_.show("batch", all_bytes_ == 0 ? 0 : static_cast<double>(bytes_) / static_cast<double>(all_bytes_),
                      note);
    }

    std::string_view program_;
    const Arguments &arguments_;
    std::span<const batch::Scan> scans_;
    std::ostream *out_;
    command_line::ProgressDisplay display_;
    Descriptor json_file_;
    int json_error_ = 0; // errno
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::array<Totals, kRows> totals_{};
    std::size_t ended_ = 0;
    std::uint64_t all_bytes_ = 0, bytes_ = 0, worked_bytes_ = 0;
    const batch::Scan *first_failed_ = scans_.data() + scans_.size();
    int exit_code_ = 0;
    bool has_warned_ = false;
};

std::array<command_line::OutputFile, 3> outputs_of(const Arguments &arguments) {
    return {{{"--json", arguments.json}, {"--progress", arguments.progress ? "-" : ""}, {"--plan", arguments.plan}}};
}

// Whether a file holds something that is no JSON.
bool holds_other_than_json(const std::string &path) {
    const auto first = std::ifstream(path, std::ios::binary).get();
    return first != std::char_traits<char>::eof() && first != '{';
}

// A line about the batch that ends no build.
void warn(std::string_view program, const Arguments &arguments, Warning kind, const std::string &message) {
    if (contains(arguments.allowed, kind))
        return;
    const std::string text = message + " [" + std::string(entry_of(kind).name) + "]";
    command_line::log_line(command_line::LogKind::warning, text);
    if (arguments.verbosity != command_line::Verbosity::quiet)
        std::cerr << program << ": warning: " << command_line::printable(text) << '\n';
}

std::string text_of(std::span<const batch::LeftOut> left_out) {
    return "left out " + std::to_string(left_out.size()) + ": " + batch::kinds_of(left_out);
}

// Whether nothing is left out that must not be.
Status check_left_out(std::span<const batch::LeftOut> left_out, bool is_strict) {
    if (std::any_of(left_out.begin(), left_out.end(), [](const auto &each) { return each.is_unreadable; }))
        return Error{ErrorCode::io, 0, text_of(left_out)};
    return is_strict && !left_out.empty() ? Status(bad_input(text_of(left_out) + ": --strict refuses that")) : Status();
}

// The share of a machine: the same whatever else is in the list.
bool is_of_shard(const batch::Scan &scan, const PartNumber &shard) {
    return shard.count == 1 || hash64(as_bytes(scan.name)) % shard.count == shard.index;
}

// Refuses outputs that are inputs, or models of this batch.
std::optional<int> refuse_files(std::string_view program, const Arguments &arguments,
                                std::span<const batch::Scan> scans) {
    std::vector<std::string> inputs = arguments.sources;
    inputs.push_back(arguments.batch);
    if (!arguments.recipe.empty())
        inputs.push_back(arguments.recipe);
    for (const batch::Scan &scan : scans)
        inputs.push_back(scan.input);
    if (const auto refused = command_line::refuse_outputs(program, inputs, outputs_of(arguments)))
        return refused;
    command_line::forget_json(); // a line for each scan instead of one document
    const std::string &log = command_line::log_path();
    for (const std::string &input : inputs)
        if (!log.empty() && command_line::same_file(log, input))
            return command_line::fail_usage(program, log + ": --log is an input; choose another name");
    for (const std::string &name : {log, arguments.json, arguments.plan})
        for (const batch::Scan &scan : scans)
            if (!name.empty() && name != "-" && command_line::same_file(name, scan.output))
                return command_line::fail_usage(program, name + ": a model of this batch has this name");
    if (!arguments.json.empty() && arguments.json != "-" && holds_other_than_json(arguments.json))
        return command_line::fail_usage(program, arguments.json + ": --json would replace a file that is no JSON");
    return std::nullopt;
}

batch::ScanRequest request_of(const Arguments &arguments) {
    return {.list_or_folder = arguments.batch,
            .output_folder = arguments.output_folder,
            .root = arguments.batch_root,
            .keep_extension = arguments.keep_extension,
            .keep_going = arguments.keep_going};
}

} // namespace

int run_batch(std::string_view program, const Arguments &arguments) {
    auto list = batch::read_scan_list(request_of(arguments));
    if (!list) {
        const bool is_of_folder_below =
            list.error().code == ErrorCode::io && list.error().message.starts_with(arguments.batch);
        return command_line::fail(program, is_of_folder_below ? "" : arguments.batch, list.error());
    }
    const Status complete = check_left_out(list->left_out, arguments.build.strict);
    if (!complete && (!arguments.keep_going || !arguments.plan.empty()))
        return command_line::fail(program, arguments.batch, complete.error());
    std::vector<std::string> stale = batch::other_models(arguments.output_folder, list->scans);
    std::erase_if(list->scans, [&](const batch::Scan &scan) { return !is_of_shard(scan, arguments.shard); });
    const std::vector<batch::Scan> &scans = list->scans;
    if (const auto refused = refuse_files(program, arguments, scans))
        return *refused;
    if (!list->left_out.empty() && complete)
        warn(program, arguments, Warning::left_out, arguments.batch + ": " + text_of(list->left_out));
    if (!stale.empty())
        warn(program, arguments, Warning::stale_model,
             stale.front() + (stale.size() == 1 ? "" : " and " + std::to_string(stale.size() - 1) + " more") +
                 ": no scan of this batch becomes this model");
    if (!arguments.plan.empty())
        return plan_batch(program, arguments, batch::root_of(request_of(arguments)), scans);
    std::error_code error;
    std::filesystem::create_directories(arguments.output_folder, error);
    if (error)
        return command_line::fail(program, arguments.output_folder,
                                  io_error("cannot create the folder", error.value()));

    batch::Request request{.builder = {"/proc/self/exe"},
                           .jobs = resolve_threads(arguments.build.threads),
                           .threads = resolve_threads(arguments.build.threads),
                           .max_memory = arguments.max_memory != 0 ? arguments.max_memory : usable_memory() / 2,
                           .keep_going = arguments.keep_going,
                           .timeout = arguments.timeout};
    request.builder.push_back("--max-memory=" + std::to_string(request.max_memory)); // also of each build
    request.builder.insert(request.builder.end(), arguments.forwarded.begin(), arguments.forwarded.end());
    BatchReport report(program, arguments, scans, command_line::report_stream(outputs_of(arguments)));
    if (const Status writable = report.json_status(); !writable)
        return command_line::fail(program, arguments.json, writable.error());
    batch::build_all(scans, request, [&](const batch::Ending &ending) { report.add(ending); });
    report.add_rest(list->left_out, stale);
    const int code = report.finish();
    const int code_of_rest = complete ? 0 : command_line::fail(program, arguments.batch, complete.error());
    return code != 0 ? code : code_of_rest;
}

} // namespace pbm::build
