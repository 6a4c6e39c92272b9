// pbm-validate: checks whether a .pbvg is valid, and reports what breaks which rule where.
#include "command_line/common_options.h"
#include "system/files/mapped_file.h"
#include "verdict.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iostream>
#include <new>

namespace {

using pbm::CatalogueEntry;
using pbm::Severity;
using pbm::ValidationLevel;
using pbm::command_line::CommandLine;
using pbm::command_line::Integers;
using pbm::validate_program::Verdict;

struct Options {
    std::vector<std::string> paths;
    std::vector<std::string> ignore, only; // codes and groups
    std::string json_path, explain, list_codes;
    bool quick = false, deep = false, errors_only = false, strict = false, recursive = false, quiet = false;
    pbm::ValidateOptions validation;
};

bool names(const std::vector<std::string> &words, const CatalogueEntry &entry) {
    return std::any_of(words.begin(), words.end(),
                       [&](const std::string &word) { return word == entry.name || word == entry.group(); });
}

// Reads the expected size from the first bytes of a stream, to read no more than that.
std::uint64_t wanted_bytes(pbm::ByteView start) {
    const pbm::Result<pbm::FileHeader> header = pbm::decode_header(start);
    if (header)
        return header->file_size + 1; // one more byte shows whether there are too many
    const auto *file_size = std::get_if<std::uint64_t>(&header.error().expected.held());
    return header.error().rule == "2.7" && file_size != nullptr ? *file_size + 1 : start.size();
}

void add_error(const pbm::Error &error, const Options &options, Verdict &verdict) {
    verdict.report.add({.code = error.code,
                        .offset = error.offset,
                        .section = "file",
                        .message = error.message,
                        .entry = pbm::entry_of(error)},
                       options.validation);
}

Verdict examine(const std::string &path, const Options &options) {
    Verdict verdict{.path = path, .report = {}};
    const pbm::Result<pbm::MappedFile> file =
        path == "-" ? pbm::MappedFile::read_stream(path, options.validation.max_memory, wanted_bytes)
                    : pbm::MappedFile::open(path);
    if (file) {
        try {
            verdict.report = pbm::validate(file->bytes(), options.validation);
        } catch (const std::bad_alloc &) {
            add_error(pbm::broken("system.memory", 0, "out of memory"), options, verdict);
        }
    } else {
        add_error(file.error(), options, verdict);
        verdict.was_read = false;
    }
    verdict.valid = verdict.report.valid() && (!options.strict || verdict.report.warnings == 0);
    verdict.exit_code = verdict.report.exit_code;
    if (!verdict.valid && verdict.exit_code == 0)
        verdict.exit_code = pbm::exit_code(pbm::ErrorCode::bad_section);
    return verdict;
}

// .bvg is the former extension.
bool is_model_name(const std::filesystem::path &name) {
    return name.extension() == ".pbvg" || name.extension() == ".bvg";
}

// Files with the extension of models below a folder, sorted by name.
pbm::Result<std::vector<std::string>> files_below(const std::string &folder) {
    namespace fs = std::filesystem;
    std::vector<std::string> files;
    std::error_code error;
    for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
        if (is_model_name(entry->path()) && !entry->is_directory())
            files.push_back(entry->path().string());
    if (error)
        return pbm::broken("io.open", 0, "cannot open: " + error.message());
    if (files.empty())
        return pbm::broken("io.not_a_file", 0, "no .pbvg file is in this folder");
    std::sort(files.begin(), files.end());
    return files;
}

void examine_folder(const std::string &folder, const Options &options, const std::function<void(Verdict)> &tell) {
    const auto files = files_below(folder);
    if (!files) {
        Verdict verdict{.path = folder, .report = {}, .was_read = false};
        add_error(files.error(), options, verdict);
        verdict.valid = verdict.report.valid();
        verdict.exit_code = verdict.report.exit_code;
        tell(std::move(verdict));
    } else {
        for (const std::string &path : *files) {
            pbm::command_line::work_on(path);
            tell(examine(path, options));
        }
    }
}

// Prints a verdict. A file that could not be read has none: that is an error of the program.
void print(const Verdict &verdict, const Options &options) {
    if (!verdict.was_read && !verdict.report.findings.empty()) {
        const pbm::Finding &finding = verdict.report.findings.front();
        pbm::command_line::fail("pbm-validate", verdict.path, {finding.code, finding.offset, finding.message});
    } else if (!options.quiet || !verdict.valid) {
        pbm::validate_program::print_text(std::cout, verdict, options.validation.level);
    }
}

void add_codes(CommandLine &line, const char *name, std::vector<std::string> &codes, const char *help,
               std::vector<std::string> excludes) {
    line.add(name, help, &codes,
             {.type = "CODE,..",
              .check = [](const std::string &word) { return pbm::validate_program::unknown_code(word); },
              .separator = ',',
              .excludes = std::move(excludes)});
}

void add_options(CommandLine &line, Options &options) {
    line.add("FILE", "Models to examine; - is standard input", &options.paths);
    line.topic = "Levels";
    line.add("--quick", "Header and section table only: milliseconds at any size", &options.quick);
    line.add("--deep", "Averages and means too, and advice: warnings and infos", &options.deep,
             {.excludes = {"--quick"}});
    line.add("--strict", "As --deep, and warnings make a file invalid", &options.strict, {.excludes = {"--quick"}});
    line.topic = "Findings";
    line.add("-e,--errors-only", "No warnings and infos", &options.errors_only);
    add_codes(line, "--ignore", options.ignore, "Codes or groups that do not count", {});
    add_codes(line, "--only", options.only, "Codes or groups that count alone", {"--ignore"});
    line.add("--max-findings", "Findings to tell of each file", &options.validation.max_findings,
             {.check = Integers{1, 1000000}, .shows_default = true});
    line.add("--max-per-code", "Findings to tell of each code", &options.validation.max_per_code,
             {.check = Integers{1, 1000000}, .shows_default = true});
    line.topic = "Codes";
    line.add("--list-codes", "All codes; --list-codes=markdown, or as JSON with --json", &options.list_codes,
             {.alone = "text"});
    line.add("--explain", "What a code, group or rule stands for", &options.explain, {.type = "CODE"});
    line.topic = "Options";
    line.add("-r,--recursive", "All .pbvg files in folders too", &options.recursive);
    line.add("-q,--quiet", "Say nothing about valid files", &options.quiet);
    pbm::command_line::add_json(line, options.json_path, "Verdicts");
    pbm::command_line::add_threads(line, options.validation.threads);
    pbm::command_line::add_max_memory(line, options.validation.max_memory);
    line.add_version(PBM_VERSION);
}

int write_json(const std::string &path, const std::string &text) {
    if (const pbm::Status status = pbm::command_line::write_text(path, text); !status)
        return pbm::command_line::fail("pbm-validate", path, status.error());
    return 0;
}

// Handles --list-codes and --explain, which need no file.
std::optional<int> tell_codes(const Options &options) {
    namespace program = pbm::validate_program;
    if (!options.explain.empty()) {
        const auto entries = program::codes_named(options.explain);
        if (entries.empty())
            return pbm::command_line::fail_usage("pbm-validate", program::unknown_code(options.explain));
        std::cout << program::codes_as_text(entries);
        return 0;
    }
    if (options.list_codes.empty())
        return std::nullopt;
    if (!options.json_path.empty())
        return write_json(options.json_path, program::codes_as_json());
    if (options.list_codes != "text" && options.list_codes != "markdown")
        return pbm::command_line::fail_usage("pbm-validate", "--list-codes: write text or markdown");
    std::vector<const CatalogueEntry *> all;
    all.reserve(pbm::kCatalogue.size());
    for (const CatalogueEntry &entry : pbm::kCatalogue)
        all.push_back(&entry);
    std::cout << (options.list_codes == "text" ? program::codes_as_text(all) : program::codes_as_markdown());
    return 0;
}

void choose(Options &options) {
    pbm::ValidateOptions &validation = options.validation;
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
    if (const auto done = pbm::command_line::parse(
            line, argc, argv, {},
            {.most_used = {"--quick", "--deep", "--ignore", "--recursive", "--json", "--quiet", "--help"},
             .examples = {{"pbm-validate -q *.pbvg", "Names the files that are not valid, and nothing else."},
                          {"pbm-validate -r --json=report.json models", "All models of a folder, for a pipeline."},
                          {"pbm-validate --explain 4.2", "What a rule is, and what to do about it."}}}))
        return *done;
    if (const auto done = tell_codes(options))
        return *done;
    if (options.paths.empty())
        return pbm::command_line::fail_usage("pbm-validate", "FILE is required");
    if (const auto refused = pbm::command_line::refuse_outputs("pbm-validate", options.paths, {{options.json_path}}))
        return *refused;
    choose(options);

    int code = 0;
    std::vector<Verdict> verdicts; // for JSON
    const auto tell = [&](Verdict verdict) {
        code = std::max(code, verdict.exit_code);
        if (options.json_path.empty())
            print(verdict, options);
        else
            verdicts.push_back(std::move(verdict));
    };
    for (const std::string &path : options.paths) {
        pbm::command_line::work_on(path);
        std::error_code unknown;
        if (options.recursive && std::filesystem::is_directory(path, unknown))
            examine_folder(path, options, tell);
        else
            tell(examine(path, options));
    }
    if (options.json_path.empty())
        return code;
    const int written =
        write_json(options.json_path, pbm::validate_program::report_as_json(verdicts, options.validation.level, code));
    return std::max(code, written);
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program("pbm-validate", [&] { return run(argc, argv); });
}
