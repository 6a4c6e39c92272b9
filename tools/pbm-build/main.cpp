// pbm-build: turns a scan into a binary voxel grid.
#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "command_line/json_report.h"
#include "memory_limit.h"
#include "options/options.h"
#include "pbm_batch/batch_run.h"
#include "pbm_batch/plan.h"
#include "pbm_build/parts/part_file.h"
#include "pbm_build/pipeline.h"
#include "pbm_build/preparing/prepare.h"
#include "pbm_scan/text/printable.h"
#include "sources/depfile.h"
#include "sources/source_files.h"
#include "sources/source_record.h"
#include "system/files/cache_folder.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"
#include "system/processes/paged_heap.h"
#include "system/processes/this_process.h"
#include "web_page.h"

#include <array>
#include <chrono>
#include <filesystem>
#include <iostream>

namespace {

using namespace pbm;
using namespace pbm::build;

constexpr std::string_view kProgram = "pbm-build";

std::string megabytes(std::uint64_t bytes) { return formatted("%.2f MB", static_cast<double>(bytes) * 1e-6); }

std::string figures(const BuildStatistics &statistics) {
    return formatted("%llu points, depth %d, voxel size %.6g, %s", static_cast<unsigned long long>(statistics.points),
                     statistics.depth, statistics.voxel_size, megabytes(statistics.file_bytes).c_str());
}

std::string full_name(const AttributeReport &line) { return (line.input.empty() ? "" : line.input + ": ") + line.name; }

std::string note(const AttributeReport &line) { return line.note.empty() ? "" : " (" + line.note + ")"; }

// " [stray-points]"
std::string kind(const AttributeReport &line) {
    const Warning warning = warning_of(line);
    return warning == Warning::none ? "" : " [" + std::string(entry_of(warning).name) + "]";
}

// The fates of attributes, the steps with --verbose, and the figures of the output.
std::string report(const Arguments &arguments, const BuildStatistics &statistics) {
    std::string text;
    for (const AttributeReport &line : statistics.attributes)
        if (!contains(arguments.allowed, warning_of(line)))
            text += command_line::printable(full_name(line) + ": " + std::string(to_string(line.fate)) + note(line) +
                                            kind(line)) +
                    "\n";
    for (const MeshFigures &figures : statistics.meshes)
        text += to_text(figures);
    if (arguments.verbosity == command_line::Verbosity::verbose)
        for (const StepStatistics &step : statistics.steps)
            text += formatted("%-14s %8.3f s, peak %s\n", step.name.c_str(), step.seconds,
                              megabytes(step.peak_memory).c_str());
    text += command_line::printable(command_line::output_name(arguments.output)) + ": " + figures(statistics);
    if (statistics.outcome != Outcome::written)
        return text + ", " + std::string(to_string(statistics.outcome)) + "\n";
    return text + formatted(", %.2f bits per point, %.3f of the input, %.2f s\n", statistics.bits_per_point(),
                            statistics.ratio(), statistics.seconds);
}

// To the log, and to standard error where the report does not say it.
void warn_of_dropped(const BuildStatistics &statistics, const Arguments &arguments) {
    for (const AttributeReport &line : statistics.attributes)
        if (line.fate == Fate::dropped && !contains(arguments.allowed, warning_of(line))) {
            const std::string text = full_name(line) + " dropped" + note(line) + kind(line);
            command_line::log_line(command_line::LogKind::warning, text);
            if (arguments.verbosity == command_line::Verbosity::warnings)
                std::cerr << kProgram << ": warning: " << command_line::printable(text) << '\n';
        }
}

// Memory ends where the folder of temporary files is full: that is what the user can change.
int fail(const std::string &path, const Error &error) {
    const Status room = error.code == ErrorCode::memory ? paged_heap_room() : Status();
    return room ? command_line::fail(kProgram, path, error) : command_line::fail(kProgram, "", room.error());
}

// Errors about one of several inputs, or about a part, begin with its name.
int fail_input(std::span<const std::string> inputs, Error error, std::span<const std::string> parts = {}) {
    if (std::error_code none;
        error.name == "io.not_a_file" && inputs.size() == 1 && std::filesystem::is_directory(inputs.front(), none))
        error.message += "; --batch builds a model of every scan in it";
    for (const auto &files : {parts, inputs})
        for (const std::string &file : files)
            if (const std::string begin = name_of(file) + ": "; error.message.starts_with(begin)) {
                error.message.erase(0, begin.size());
                return fail(name_of(file), error);
            }
    return fail(inputs.size() == 1 ? name_of(inputs.front()) : "", error);
}

std::array<command_line::OutputFile, 4> outputs_of(const Arguments &arguments) {
    return {{{"--output", arguments.output},
             {"--dependency-file", arguments.depfile_name},
             {"--json", arguments.json},
             // Its lines begin with a number: they and the JSON behind them are told apart.
             {"--progress", arguments.progress && arguments.json != "-" ? "-" : ""}}};
}

// Refuses impossible combinations of files before any work.
std::optional<int> refuse(const Arguments &arguments, std::span<const std::string> files) {
    const bool to_stdout = arguments.output == "-";
    if (to_stdout && !arguments.page.empty())
        return command_line::fail_usage(kProgram, "--page needs an output with a name; leave out -o -");
    if (to_stdout && (arguments.if_changed || arguments.depfile))
        return command_line::fail_usage(kProgram,
                                        "--if-changed and dependency files need an output with a name; use -o");
    const bool has_parts = arguments.shard.count > 1 || arguments.merged > 0 || arguments.shards > 0;
    if (arguments.if_changed || arguments.source_hash || !arguments.cache.empty() || has_parts || arguments.action_key)
        for (const std::string &file : files)
            if (is_stream(file))
                return command_line::fail_usage(
                    kProgram, file + ": --if-changed, --source-hash, --action-key, --cache and parts read the input "
                                     "twice: a stream cannot be");
    if (arguments.action_key)
        return std::nullopt;
    if (const auto refused = command_line::refuse_outputs(kProgram, files, outputs_of(arguments)))
        return refused;
    if (!arguments.depfile)
        return std::nullopt;
    if (const Status writable = check_depfile_target(arguments.depfile_target); !writable)
        return fail(arguments.depfile_target, writable.error());
    for (const std::string &name : files)
        if (const Status writable = check_depfile_name(name); !writable && !is_stream(name))
            return fail(name, writable.error());
    return std::nullopt;
}

void take_figures(const ModelFigures &figures, Outcome outcome, BuildStatistics &statistics) {
    statistics.outcome = outcome;
    statistics.points = figures.points;
    statistics.depth = figures.depth;
    statistics.voxel_size = figures.voxel_size;
    statistics.file_bytes = figures.file_bytes;
}

// A cache that fails is no failure of the build.
void warn_of_cache(const Arguments &arguments, const std::string &what) {
    if (!contains(arguments.allowed, Warning::cache_not_filled))
        command_line::warn(kProgram, what + " [" + std::string(entry_of(Warning::cache_not_filled).name) + "]");
}

void fill_cache(const CacheFolder &cache, const std::string &file, const Arguments &arguments) {
    std::error_code error;
    const bool is_in_the_way = std::filesystem::exists(file, error) && !std::filesystem::is_regular_file(file, error);
    const Result<MappedFile> model = is_in_the_way ? Result<MappedFile>(Error{ErrorCode::io, 0, "it is no file"})
                                                   : MappedFile::open(arguments.output);
    const Status stored = model ? replace_file(file, model->bytes(), Durability::cached) : Status(model.error());
    if (stored)
        return cache.evict_others(file);
    warn_of_cache(arguments, "the cache is not filled: " + file + ": " + stored.error().message);
}

// Reads the panorama before the scan, which may take minutes, so that a bad image is refused early. Empty if none is
// requested.
Result<Image> read_panorama_first(const Arguments &arguments, BuildStatistics &statistics, const Progress &progress) {
    const auto &request = arguments.build.scene.panorama;
    if (!request)
        return Image{};
    return StepClock(statistics, progress).run("panorama", [&] {
        return make_panorama(*request, arguments.build.threads, statistics);
    });
}

Result<SourceRecord> record_of(const Arguments &arguments, const SourceFiles &sources) {
    // Poses and viewpoints belong to inputs one by one; else no order of inputs changes the model.
    const bool in_order = arguments.build.poses.size() > 1 || arguments.build.viewpoints.size() > 1;
    return make_record(sources, arguments.request, in_order);
}

// Whether the output holds the record.
bool keeps_record(const Arguments &arguments) { return arguments.if_changed || arguments.source_hash; }

// Prints the key under which a cache of this program's, or a remote one, keeps the output. Returns the exit code.
int print_action_key(const Arguments &arguments, const SourceFiles &sources) {
    const auto record = record_of(arguments, sources);
    if (!record)
        return fail_input(sources.there, record.error());
    std::cout << cache_key(*record, keeps_record(arguments)) << '\n';
    return 0;
}

// Before the output, so that a build that is killed leaves no output without what it depends on. Returns the exit code.
int write_depfile(const Arguments &arguments, const SourceFiles &sources) {
    if (!arguments.depfile)
        return 0;
    std::vector<std::string> files = sources.there;
    std::erase_if(files, is_stream);
    // A missing file may appear with any time, and perhaps with other capital letters.
    const Status written = command_line::write_text(
        arguments.depfile_name, depfile_text(arguments.depfile_target, files, !sources.missing.empty()));
    return written ? 0 : fail(command_line::output_name(arguments.depfile_name), written.error());
}

// Builds the part `output`, unless it is there. Returns the exit code.
int build_part(const Arguments &arguments, const SourceFiles &sources, BuildStatistics &statistics) {
    const auto record = record_of(arguments, sources);
    if (!record)
        return fail_input(sources.there, record.error());
    const PartName name{cache_key(*record, false), arguments.shard};
    const auto take = [&](const PartFigures &part) {
        statistics.points = part.points;
        statistics.depth = part.grid.depth;
        statistics.voxel_size = part.grid.voxel_size;
        std::error_code error;
        statistics.file_bytes = std::filesystem::file_size(arguments.output, error);
    };
    if (const auto found = find_part(arguments.output, name)) {
        statistics.outcome = Outcome::up_to_date;
        take(*found);
        return write_depfile(arguments, sources);
    }
    command_line::ProgressDisplay display(arguments.verbosity, arguments.progress);
    const Progress progress = [&](std::string_view step, double done) { display.show(step, done); };
    const Result<Part> part =
        read_and_build_part(arguments.inputs, arguments.shard, arguments.build, statistics, progress);
    display.clear();
    if (!part)
        return fail_input(arguments.inputs, part.error());
    if (const Status unchanged = verify_unchanged(sources); !unchanged)
        return fail_input(sources.there, unchanged.error());
    warn_of_dropped(statistics, arguments);
    if (const int code = write_depfile(arguments, sources); code != 0)
        return code;
    if (const Status written = write_part(arguments.output, name, *part); !written)
        return fail(arguments.output, written.error());
    take({part->parameters.grid, part->voxels.codes.size()});
    return 0;
}

std::vector<std::string> parts_to_merge(const Arguments &arguments) {
    std::vector<std::string> files;
    for (std::uint64_t i = 0; i < arguments.merged; ++i)
        files.push_back(part_file_name(arguments.output, {i, arguments.merged}));
    return files;
}

// Joins parts. Errors begin with the name of a part or an input.
Result<Model> merge(const Arguments &arguments, const std::string &key, std::span<const std::string> files,
                    BuildStatistics &statistics, const Progress &progress) {
    std::vector<Part> parts;
    StepClock clock(statistics, progress);
    for (std::uint64_t i = 0; i < arguments.merged; ++i) {
        Result<Part> part = clock.run("read parts", [&] { return read_part(files[i], {key, {i, arguments.merged}}); });
        if (!part)
            return Error{part.error().code, 0,
                         files[i] + ": " + part.error().message + "; --shard " + std::to_string(i) + "/" +
                             std::to_string(arguments.merged) + " with the same inputs and options builds it"};
        parts.push_back(std::move(*part));
    }
    return merge_parts(std::move(parts), arguments.inputs, arguments.build, statistics, progress);
}

// Builds and writes, unless --if-changed finds that the output would be the same. Returns the exit code.
int build(const Arguments &arguments, const SourceFiles &sources, BuildStatistics &statistics) {
    SourceRecord record;
    const std::optional<EarlierOutput> earlier =
        arguments.if_changed ? find_earlier_output(arguments.output) : std::nullopt;
    const auto take_record = [&]() -> Status {
        auto made = record_of(arguments, sources);
        if (!made)
            return made.error();
        record = std::move(*made);
        return {};
    };
    // Without anything to compare it with, it is made of what is read then: huge scans are mostly refused at once.
    const bool has_record = earlier || !arguments.cache.empty() || arguments.merged > 0;
    if (has_record)
        if (const Status taken = take_record(); !taken)
            return fail_input(sources.there, taken.error());
    if (earlier && earlier->record == record) {
        take_figures(earlier->figures, Outcome::up_to_date, statistics);
        return write_depfile(arguments, sources);
    }
    std::optional<CacheFolder> cache;
    std::string cached;
    if (!arguments.cache.empty()) {
        auto opened = CacheFolder::open(arguments.cache, arguments.cache_size);
        if (opened)
            cache = std::move(*opened);
        else
            warn_of_cache(arguments, "the cache is not used: " + arguments.cache + ": " + opened.error().message);
    }
    if (cache) {
        cached = cache->file_of(cache_key(record, keeps_record(arguments)));
        if (std::error_code none; std::filesystem::is_regular_file(cached, none))
            if (const int code = write_depfile(arguments, sources); code != 0)
                return code;
        // A report of the mesh is made by building.
        const auto copied =
            arguments.build.mesh.report ? Result(std::optional<ModelFigures>()) : copy_cached(cached, arguments.output);
        if (!copied)
            return fail(command_line::output_name(arguments.output), copied.error());
        if (*copied) {
            take_figures(**copied, Outcome::cached, statistics);
            return 0;
        }
    }

    command_line::ProgressDisplay display(arguments.verbosity, arguments.progress);
    const Progress progress = [&](std::string_view step, double done) { display.show(step, done); };
    auto panorama = read_panorama_first(arguments, statistics, progress);
    if (!panorama) {
        display.clear();
        return fail(arguments.build.scene.panorama->file, panorama.error());
    }
    const std::vector<std::string> parts = parts_to_merge(arguments);
    Result<Model> model = parts.empty() ? read_and_build(arguments.inputs, arguments.build, statistics, progress)
                                        : merge(arguments, cache_key(record, false), parts, statistics, progress);
    display.clear();
    if (!model)
        return fail_input(arguments.inputs, model.error(), parts);
    if (!has_record && keeps_record(arguments))
        if (const Status taken = take_record(); !taken)
            return fail_input(sources.there, taken.error());
    if (const Status unchanged = verify_unchanged(sources); !unchanged)
        return fail_input(sources.there, unchanged.error());
    model->images.panorama = std::move(*panorama);
    warn_of_dropped(statistics, arguments);
    if (keeps_record(arguments)) {
        auto metadata = with_record(model->metadata, record);
        if (!metadata)
            return fail_input(arguments.inputs, metadata.error());
        model->metadata = std::move(*metadata);
    }
    if (const int code = write_depfile(arguments, sources); code != 0)
        return code;
    if (earlier && is_same(*earlier, *model)) {
        take_figures(earlier->figures, Outcome::unchanged, statistics);
        return 0;
    }
    const Status written = write(arguments.output, *model, arguments.build, statistics, progress);
    display.clear();
    if (!written)
        return fail(command_line::output_name(arguments.output), written.error());
    if (cache && !is_stream(arguments.output))
        fill_cache(*cache, cached, arguments);
    return 0;
}

int run(Arguments &arguments, std::chrono::steady_clock::time_point start) {
    const auto is_stream_of_any = [](const auto &files) { return std::any_of(files.begin(), files.end(), is_stream); };
    if (const char *const folder = std::getenv("PBM_CACHE_DIR");
        folder != nullptr && arguments.cache.empty() && !is_stream_of_any(arguments.inputs))
        arguments.cache = folder;
    if (!arguments.batch.empty())
        return run_batch(kProgram, arguments);
    const bool is_part = arguments.shard.count > 1;
    if (is_part)
        arguments.output = part_file_name(arguments.output, arguments.shard);
    const bool builds = arguments.plan.empty() && !arguments.action_key;
    if (const auto failed = builds ? limit_memory(kProgram, arguments) : std::nullopt)
        return *failed;
    PageFolder page;
    if (const auto failed = page.begin(kProgram, arguments))
        return *failed;
    if (arguments.depfile && arguments.depfile_name.empty())
        arguments.depfile_name = arguments.output + ".d";
    if (arguments.depfile_target.empty())
        arguments.depfile_target = arguments.output;
    const SourceFiles sources = find_sources(arguments.sources, arguments.inputs, arguments.recipe);
    if (const auto refused = refuse(arguments, sources.there))
        return *refused;
    if (arguments.action_key)
        return print_action_key(arguments, sources);
    if (!arguments.grid_like.empty()) {
        Result<Grid> grid = read_grid(arguments.grid_like);
        if (!grid)
            return fail(arguments.grid_like, grid.error());
        arguments.build.grid.like = *grid;
    }

    if (!arguments.plan.empty())
        return plan_parts(kProgram, arguments);
    BuildStatistics statistics;
    if (const int code = (is_part ? build_part : build)(arguments, sources, statistics); code != 0)
        return code;
    std::ostream *const stream = command_line::report_stream(outputs_of(arguments));
    statistics.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (arguments.verbosity >= command_line::Verbosity::normal && stream != nullptr)
        *stream << report(arguments, statistics);
    if (const auto failed = make_page(kProgram, arguments, stream))
        return *failed;
    if (arguments.json.empty())
        return 0;
    return command_line::write_json(kProgram, arguments.json, to_json(statistics, arguments.inputs, arguments.output));
}

} // namespace

int main(int argc, char **argv) {
    const auto start = std::chrono::steady_clock::now();
    return command_line::run_program(kProgram, [&] {
        Arguments arguments;
        if (const auto done = parse(kProgram, argc, argv, arguments))
            return *done;
        try {
            return run(arguments, start);
        } catch (const std::bad_alloc &) {
            if (const Status room = paged_heap_room(); !room)
                return fail("", room.error());
            throw;
        }
    });
}
