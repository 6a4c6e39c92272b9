#include "viewer/opening/prepared_model.h"

#include "command_line/parse.h"
#include "pbm_format/container/layout.h"
#include "pbm_format/reading/reader.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"
#include "system/processes/child_program.h"
#include "viewer/opening/model_cache.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBuilder = "pbm-build", kNoCache = "none";

Result<std::string> find_builder(const std::string &named) {
    if (!named.empty())
        return named;
    if (std::string found = find_program(kBuilder); !found.empty())
        return found;
    return Error{ErrorCode::memory, 0,
                 "a scan is shown as the model that pbm-build makes of it, and pbm-build is not installed"};
}

// Whether the scan alone decides the model, as its record says: not files that the scan or a recipe names.
bool is_of_scan_alone(const std::string &model) {
    const auto file = MappedFile::open(model);
    if (!file)
        return false;
    const auto reader = Reader::open(file->bytes());
    if (!reader)
        return false;
    const std::string_view metadata = reader->metadata();
    return metadata.find("\"source_hash\":") != std::string_view::npos &&
           metadata.find("\"source_files\":") == std::string_view::npos;
}

ErrorCode code_of(int exit_code) {
    switch (exit_code) {
    case 1: return ErrorCode::usage;
    case 2: return ErrorCode::io;
    case 3: return ErrorCode::bad_input;
    case 5: return ErrorCode::unsupported_feature;
    default: return ErrorCode::memory;
    }
}

// The error of a build that ended like this; its message lost the names of pbm-build and of the scan.
Error build_error(const ProgramEnd &end, const std::string &scan) {
    if (end.exit_code < 0)
        return {ErrorCode::memory, 0, "a signal ended pbm-build"};
    std::string message = end.message;
    for (const std::string &prefix : {std::string(kBuilder) + ": ", command_line::printable(scan) + ": "})
        if (message.starts_with(prefix))
            message.erase(0, prefix.size());
    if (message.empty())
        message = "pbm-build ended with exit code " + std::to_string(end.exit_code);
    return {code_of(end.exit_code), 0, message};
}

Status build(const std::string &builder, const std::string &scan, const std::string &output,
             const Preparation &preparation) {
    std::vector<std::string> command{builder,
                                     "--quiet",
                                     "--progress",
                                     "--if-changed",
                                     "--threads=" + std::to_string(preparation.threads),
                                     "--output=" + output};
    if (!preparation.scans.recipe.empty())
        command.emplace_back("--recipe=" + preparation.scans.recipe);
    for (const std::string &field : preparation.scans.fields)
        command.emplace_back("--field=" + field);
    command.insert(command.end(), preparation.scans.options.begin(), preparation.scans.options.end());
    command.insert(command.end(), {"--", scan});
    const auto report = [&](std::string_view line) { // PERCENT STEP
        int percent = 0;
        const char *const end = line.data() + line.size();
        const auto [rest, error] = std::from_chars(line.data(), end, percent);
        if (preparation.progress && error == std::errc() && rest != end)
            preparation.progress({rest + 1, end}, percent / 100.0);
    };
    const auto ended = run_program(command, report, preparation.stop);
    if (!ended)
        return ended.error();
    return ended->exit_code == 0 ? Status() : build_error(*ended, scan);
}

Result<PreparedModel> build_outside_cache(const std::string &builder, const std::string &scan,
                                          const Preparation &preparation) {
    std::error_code error;
    std::string folder = (fs::temp_directory_path(error) / "pbm-XXXXXX").string();
    if (error || ::mkdtemp(folder.data()) == nullptr)
        return Error{ErrorCode::io, 0, "cannot create a folder for the model of the scan; name one with --cache"};
    PreparedModel model{folder + "/model.pbvg", std::shared_ptr<const void>(nullptr, [folder](const void *) {
                            std::error_code ignored;
                            fs::remove_all(folder, ignored);
                        })};
    if (const Status built = build(builder, scan, model.file, preparation); !built)
        return built.error();
    return model;
}

Result<PreparedModel> build_without_cache(const std::string &builder, const std::string &scan,
                                          const Preparation &preparation, const std::string &why) {
    auto model = build_outside_cache(builder, scan, preparation);
    if (model)
        model->warning = "the cache is not used: " + why + "; name another folder with --cache";
    return model;
}

// Empty: none.
std::string cache_folder(const ScanOptions &options) {
    const char *const given = std::getenv("PBM_CACHE");
    const std::string folder = !options.cache.empty() ? options.cache : given != nullptr ? given : "";
    return folder == kNoCache ? "" : folder.empty() ? xdg_folder("XDG_CACHE_HOME", ".cache", "pbm") : folder;
}

} // namespace

void add_scan_options(command_line::CommandLine &line, ScanOptions &options) {
    line.add("--cache",
             "Folder for the models that pbm-build makes of scans, at most 4 GB; none: build anew each time; default "
             "$PBM_CACHE, else ~/.cache/pbm",
             &options.cache, {.type = "DIR", .topic = "General"});
    line.add("--recipe", "Options of pbm-build for scans: a recipe", &options.recipe,
             {.type = "FILE.toml", .topic = "General"});
}

bool is_scan(const std::string &path) {
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored))
        return false;
    const std::string extension = lower_extension(path);
    std::array<char, kMagic.size()> start{};
    std::ifstream file(path, std::ios::binary);
    file.read(start.data(), start.size());
    const bool has_magic = std::equal(start.begin(), start.end(), kMagic.begin(),
                                      [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
    return file.is_open() && !has_magic && extension != ".pbvg" && extension != ".bvg";
}

Result<PreparedModel> prepare_model(const std::string &path, const Preparation &preparation) {
    if (!is_scan(path))
        return PreparedModel{path};
    const auto builder = find_builder(preparation.builder);
    if (!builder)
        return builder.error();
    std::vector<std::string> sources{path, *builder};
    if (const std::string &recipe = preparation.scans.recipe; !recipe.empty()) {
        std::error_code error;
        static_cast<void>(fs::file_size(recipe, error));
        if (error)
            return io_error("--recipe " + command_line::printable(recipe) + ": cannot open", error.value());
        sources.push_back(recipe);
    }
    const std::string folder = cache_folder(preparation.scans);
    if (folder.empty())
        return build_outside_cache(*builder, path, preparation);
    const auto cache = ModelCache::open(folder);
    if (!cache)
        return build_without_cache(*builder, path, preparation, folder + ": " + cache.error().message);
    std::string fields; // separated as no name of a field is
    for (const std::vector<std::string> &words : {preparation.scans.fields, preparation.scans.options})
        for (const std::string &word : words)
            fields += (fields.empty() ? "" : "\n") + word;
    auto names = cache->names_for(sources, fields, preparation.now);
    if (!names)
        return names.error();
    if (names->is_settled && ModelCache::use(names->settled) && is_of_scan_alone(names->settled))
        return PreparedModel{std::move(names->settled)};
    // The program compares contents: of a scan that had just changed, or of what a scan names.
    std::error_code ignored;
    const bool is_young = !names->is_settled || fs::exists(names->young, ignored);
    const std::string &file = is_young ? names->young : names->settled;
    if (const Status built = build(*builder, path, file, preparation); !built) {
        if (built.error().message.starts_with(command_line::printable(file)))
            return build_without_cache(*builder, path, preparation, built.error().message);
        return built.error();
    }
    if (is_young && names->is_settled)
        fs::create_hard_link(file, names->settled, ignored); // another program may be about to open the first name
    ModelCache::use(file);
    cache->evict_others(file);
    return PreparedModel{file};
}

} // namespace pbm
