// pbm-validate: checks whether a .pbvg is valid, and reports what breaks which rule where.
#include "command_line/common_options.h"
#include "command_line/json_report.h"
#include "pbm_format/hashes/hash.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"
#include "verdict.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <iostream>
#include <new>
#include <set>
#include <sstream>

namespace {

using namespace pbm;
using namespace pbm::validate_program;
using command_line::CommandLine;
using command_line::Integers;

struct Options {
    std::vector<std::string> paths;
    std::vector<std::string> ignore, only; // codes and groups
    std::string json_path, sarif_path, junit_path, explain, list_codes;
    bool quick = false, deep = false, errors_only = false, strict = false, recursive = false, quiet = false;
    ValidateOptions validation;
};

bool names(const std::vector<std::string> &words, const CatalogueEntry &entry) {
    return std::any_of(words.begin(), words.end(),
                       [&](const std::string &word) { return word == entry.name || word == entry.group(); });
}

// Reads the expected size from the first bytes of a stream, to read no more than that.
std::uint64_t wanted_bytes(ByteView start) {
    const Result<FileHeader> header = decode_header(start);
    if (header)
        return header->file_size + 1; // one more byte shows whether there are too many
    const auto *file_size = std::get_if<std::uint64_t>(&header.error().expected.held());
    return header.error().rule == "2.7" && file_size != nullptr ? *file_size + 1 : start.size();
}

ValidationReport report_of(const Error &error, const Options &options) {
    ValidationReport report;
    report.add({.code = error.code,
                .offset = error.offset,
                .section = "file",
                .message = error.message,
                .entry = entry_of(error)},
               options.validation);
    return report;
}

Verdict conclude(const std::string &path, ValidationReport report, bool was_read, const Options &options) {
    Verdict verdict{.path = path, .report = std::move(report), .was_read = was_read};
    verdict.valid = verdict.report.valid() && (!options.strict || verdict.report.warnings == 0);
    verdict.exit_code = verdict.report.exit_code;
    if (!verdict.valid && verdict.exit_code == 0)
        verdict.exit_code = exit_code(ErrorCode::bad_section);
    return verdict;
}

std::string hash_of(ByteView bytes) {
    StreamingHash hash;
    hash.add(bytes);
    return hexadecimal(hash.finish());
}

Verdict examine(const std::string &path, const Options &options) {
    const Result<MappedFile> file = path == "-"
                                        ? MappedFile::read_stream(path, options.validation.max_memory, wanted_bytes)
                                        : MappedFile::open(path);
    if (!file)
        return conclude(path, report_of(file.error(), options), false, options);
    Verdict verdict;
    try {
        verdict = conclude(path, validate(file->bytes(), options.validation), true, options);
    } catch (const std::bad_alloc &) {
        verdict = conclude(path, report_of(broken("system.memory", 0, "out of memory"), options), true, options);
    }
    verdict.bytes = file->bytes().size();
    if (!options.sarif_path.empty() && !options.quick) // which reads no more than the front
        verdict.hash = hash_of(file->bytes());
    return verdict;
}

// .bvg is the former extension. Other systems' file names may be in capitals.
bool is_model_name(const std::filesystem::path &name) {
    const std::string extension = lower_case(name.extension().string());
    return extension == ".pbvg" || extension == ".bvg";
}

// Files with the extension of models below a folder, sorted by name.
Result<std::vector<std::string>> files_below(const std::string &folder) {
    namespace fs = std::filesystem;
    std::vector<std::string> files;
    std::error_code error;
    for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
        if (is_model_name(entry->path()) && !entry->is_directory())
            files.push_back(entry->path().string());
    if (error)
        return broken("io.open", 0, "cannot open: " + error.message());
    if (files.empty())
        return broken("io.not_a_file", 0, "no .pbvg file is in this folder");
    std::sort(files.begin(), files.end());
    return files;
}

void examine_folder(const std::string &folder, const Options &options, const std::function<void(Verdict)> &report) {
    const auto files = files_below(folder);
    if (!files)
        return report(conclude(folder, report_of(files.error(), options), false, options));
    for (const std::string &path : *files) {
        command_line::work_on(path);
        report(examine(path, options));
    }
}

// Prints a verdict. A file that could not be read has none: that is an error of the program.
void print(const Verdict &verdict, const Options &options) {
    if (!verdict.was_read && !verdict.report.findings.empty()) {
        const Finding &finding = verdict.report.findings.front();
        command_line::fail("pbm-validate", verdict.path, {finding.code, finding.offset, finding.message});
    } else if (!options.quiet || !verdict.valid) {
        print_text(std::cout, verdict, options.validation.level);
    }
}

// Codes, their groups, and, where `rules` is set, rules of BVG.md.
std::vector<std::string> proposals(bool rules) {
    std::set<std::string> words;
    for (const CatalogueEntry &entry : kCatalogue) {
        words.emplace(entry.name);
        words.emplace(entry.group());
        std::istringstream each{std::string(entry.rules)};
        for (std::string rule; rules && each >> rule;)
            words.insert(rule);
    }
    return {words.begin(), words.end()};
}

void add_codes(CommandLine &line, const char *name, std::vector<std::string> &codes, const char *help,
               std::vector<std::string> excludes) {
    line.add(name, help, &codes,
             {.type = "CODE,..",
              .check = [](const std::string &word) { return unknown_code(word); },
              .separator = ',',
              .excludes = std::move(excludes),
              .proposals = [] { return proposals(false); }});
}

void add_options(CommandLine &line, Options &options) {
    line.add("FILE", "Models to check; - is standard input", &options.paths);
    line.topic = "Levels";
    line.add("--quick", "Header and section table only: milliseconds at any size", &options.quick);
    line.add("--deep", "Averages and means too, and advice: warnings and infos", &options.deep,
             {.excludes = {"--quick"}});
    line.add("--strict", "As --deep, and warnings make a file invalid", &options.strict, {.excludes = {"--quick"}});
    line.topic = "Findings";
    line.add("-e,--errors-only", "No warnings and infos", &options.errors_only);
    add_codes(line, "--ignore", options.ignore, "Codes or groups that do not count", {});
    add_codes(line, "--only", options.only, "Codes or groups that count alone", {"--ignore"});
    line.add("--max-findings", "Findings to print of each file", &options.validation.max_findings,
             {.check = Integers{1, 1000000}, .shows_default = true});
    line.add("--max-per-code", "Findings to print of each code", &options.validation.max_per_code,
             {.check = Integers{1, 1000000}, .shows_default = true});
    line.topic = "Codes";
    line.add("--list-codes", "All codes; --list-codes=markdown, or as JSON with --json", &options.list_codes,
             {.alone = "text"});
    line.add("--explain", "What a code, group or rule stands for", &options.explain,
             {.type = "CODE", .proposals = [] { return proposals(true); }});
    line.topic = "Options";
    line.add("-r,--recursive", "All .pbvg files in folders too", &options.recursive);
    line.add("-q,--quiet", "Say nothing about valid files", &options.quiet);
    command_line::add_json(line, options.json_path, "Verdicts");
    line.add("--sarif", "Findings as SARIF 2.1.0, to FILE beside the text, or (--sarif alone) to stdout",
             &options.sarif_path, {.type = "[=FILE]"});
    line.add("--junit", "Verdicts as JUnit XML, to FILE beside the text, or (--junit alone) to stdout",
             &options.junit_path, {.type = "[=FILE]"});
    command_line::add_threads(line, options.validation.threads);
    command_line::add_max_memory(line, options.validation.max_memory);
    line.add_version(PBM_VERSION);
}

// Handles --list-codes and --explain, which need no file.
std::optional<int> tell_codes(const Options &options) {
    if (!options.explain.empty()) {
        const auto entries = codes_named(options.explain);
        if (entries.empty())
            return command_line::fail_usage("pbm-validate", unknown_code(options.explain));
        std::cout << codes_as_text(entries);
        return 0;
    }
    if (options.list_codes.empty())
        return std::nullopt;
    if (!options.json_path.empty())
        return command_line::write_json("pbm-validate", options.json_path, codes_as_json());
    if (options.list_codes != "text" && options.list_codes != "markdown")
        return command_line::fail_usage("pbm-validate", "--list-codes: write text or markdown");
    std::cout << (options.list_codes == "text" ? codes_as_text(codes_named("")) : codes_as_markdown());
    return 0;
}

// Returns the exit code.
int write(const std::string &path, const std::string &document) {
    const Status written = command_line::write_text(path, document);
    return written ? 0 : command_line::fail("pbm-validate", command_line::output_name(path), written.error());
}

void choose(Options &options) {
    ValidateOptions &validation = options.validation;
    validation.level = options.quick                    ? ValidationLevel::quick
                       : options.deep || options.strict ? ValidationLevel::deep
                                                        : ValidationLevel::standard;
    validation.least = options.errors_only ? Severity::error : Severity::info;
    if (!options.ignore.empty() || !options.only.empty())
        validation.wanted = [&options](const CatalogueEntry &entry) {
            return options.only.empty() ? !names(options.ignore, entry) : names(options.only, entry);
        };
}

int run(int argc, char **argv) {
    CommandLine line{"pbm-validate",
                     "Says whether binary voxel grids (.pbvg) are valid, and if not, what breaks which rule where.\n"
                     "The rules are those of BVG.md. Of several files the highest exit code counts."};
    Options options;
    options.validation.max_per_code = 10;
    add_options(line, options);
    if (const auto done = command_line::parse(
            line, argc, argv, {},
            {.most_used = {"--quick", "--deep", "--ignore", "--recursive", "--json", "--quiet", "--help"},
             .examples = {{"pbm-validate -q *.pbvg", "Names the files that are not valid, and nothing else."},
                          {"pbm-validate -r --json=report.json models", "All models of a folder, for a pipeline."},
                          {"pbm-validate --explain 4.2", "What a rule is, and what to do about it."}}}))
        return *done;
    if (const auto done = tell_codes(options))
        return *done;
    if (options.paths.empty())
        return command_line::fail_usage("pbm-validate", "FILE is required");
    const std::array<command_line::OutputFile, 3> outputs{
        {{"--json", options.json_path}, {"--sarif", options.sarif_path}, {"--junit", options.junit_path}}};
    if (const auto refused = command_line::refuse_outputs("pbm-validate", options.paths, outputs))
        return *refused;
    choose(options);

    int code = 0;
    const bool says_text = options.json_path.empty() && options.sarif_path != "-" && options.junit_path != "-";
    const bool keeps = !options.json_path.empty() || !options.sarif_path.empty() || !options.junit_path.empty();
    std::vector<Verdict> verdicts; // for the documents
    const auto report = [&](Verdict verdict) {
        code = std::max(code, verdict.exit_code);
        if (says_text)
            print(verdict, options);
        if (keeps)
            verdicts.push_back(std::move(verdict));
    };
    for (const std::string &path : options.paths) {
        command_line::work_on(path);
        std::error_code unknown;
        if (options.recursive && std::filesystem::is_directory(path, unknown))
            examine_folder(path, options, report);
        else
            report(examine(path, options));
    }
    const ValidationLevel level = options.validation.level;
    const int verdict = code;
    if (!options.sarif_path.empty())
        code = std::max(code, write(options.sarif_path, report_as_sarif(verdicts, level, verdict)));
    if (!options.junit_path.empty())
        code = std::max(code, write(options.junit_path, report_as_junit(verdicts, level)));
    if (!options.json_path.empty())
        code = std::max(code, command_line::write_json("pbm-validate", options.json_path,
                                                       report_as_json(verdicts, level, verdict)));
    return code;
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program("pbm-validate", [&] { return run(argc, argv); });
}
