// pbm-build: turns a scan into a binary voxel grid.
#include "command_line/parse.h"
#include "pbm_build/pipeline.h"
#include "pbm_format/layout.h"
#include "pbm_format/platform.h"
#include "progress_display.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>

namespace {

using namespace pbm;
using namespace pbm::build;

constexpr std::string_view kProgram = "pbm-build";

struct Arguments {
    std::string input, output;
    std::string json; // file, "-" for stdout, empty for none
    BuildOptions build;
    Verbosity verbosity = Verbosity::normal;
};

// Switches of the dissertation's program that bake something: they need a builder that can.
constexpr std::array<command_line::OldSwitch, 4> kBakingSwitches{
    {{"-SHADOW", ""}, {"-TEXTURE", ""}, {"-BACKGROUND", ""}, {"-ENVIRONMENT_MAP", ""}}};

// An option that takes one of some words.
template <class T>
void add_choice(CLI::App &app, const std::string &names, T &value, const std::map<std::string, T> &words,
                const std::string &help) {
    std::vector<std::string> known;
    known.reserve(words.size());
    for (const auto &[word, meaning] : words)
        known.push_back(word);
    app.add_option_function<std::string>(
           names, [&value, words](const std::string &word) { value = words.at(word); }, help)
        ->check(CLI::IsMember(known));
}

// CLI11's own check prints the range of a double, 300 digits.
std::string positive(const std::string &text) {
    const char *const end = text.data() + text.size();
    double value = 0;
    const auto [stop, failure] = std::from_chars(text.data(), end, value);
    return failure == std::errc() && stop == end && value > 0 && std::isfinite(value)
               ? ""
               : "Value " + text + " is not a positive number";
}

// Fills `arguments`, or returns the exit code of a program that has said all it had to say.
std::optional<int> parse(int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Turns a scan (PLY, OBJ, STL, OFF) into a binary voxel grid (.bvg).\n"
                 "Exit codes: 0 done, 1 usage, 2 I/O, 3 damaged input, 4 memory, 5 unsupported.",
                 "pbm-build"};
    BuildOptions &options = arguments.build;
    app.add_option("INPUT", arguments.input, "Scan to read")->required();
    app.add_option("-o,--output", arguments.output, "File to write; default: the input's name with .bvg");
    app.add_option("-j,--threads", options.threads, "Threads, 0 for all processors")->check(CLI::Range(0, 1024));
    auto *depth = app.add_option("--depth", options.grid.depth, "Depth: 2^N voxels per edge of the grid, 5..16")
                      ->check(CLI::Range(kMinBuildDepth, kMaxDepth));
    auto *voxel_size = app.add_option("--voxel-size", options.grid.voxel_size,
                                      "Voxel edge in model units; the grid snaps to multiples of it")
                           ->check(positive);
    auto *max_points = app.add_option("--max-points", options.grid.max_points,
                                      "Depth with at most so many points, estimated from the area")
                           ->check(positive);
    depth->excludes(voxel_size)->excludes(max_points);
    voxel_size->excludes(max_points);
    app.add_option("-z,--compression-level", options.compression_level, "zstd level 1..19")
        ->check(CLI::Range(1, 19))
        ->capture_default_str();
    add_choice<ColourFormat>(app, "--colour,--color", options.colour,
                             {{"565", ColourFormat::rgb565}, {"888", ColourFormat::rgb888}},
                             "Bits of a colour; default 888");
    add_choice<Unit>(app, "--unit", options.grid.unit,
                     {{"unknown", Unit::unknown},
                      {"m", Unit::metre},
                      {"mm", Unit::millimetre},
                      {"cm", Unit::centimetre},
                      {"in", Unit::inch},
                      {"ft", Unit::foot},
                      {"km", Unit::kilometre}},
                     "Unit of the coordinates");
    add_choice<UpAxis>(app, "--up", options.grid.up, {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
                       "Axis that points up; default y");
    app.add_option("--name", options.credits.name, "Name of the model, kept in the file");
    app.add_option("--licence,--license", options.credits.licence, "Licence, kept in the file");
    app.add_option("--credit", options.credits.credit, "Whom to credit, kept in the file");
    app.add_flag("--flip-faces", options.flip_faces, "Turn all faces around: for scans that look inside out");
    app.add_flag("--strict", options.strict, "Refuse the input if anything of it would be dropped");
    app.add_option("--json", arguments.json, "Statistics as JSON, to FILE or (--json alone) to stdout")
        ->type_name("[=FILE]");
    app.add_flag_callback(
        "-q,--quiet", [&] { arguments.verbosity = Verbosity::quiet; }, "Say nothing but errors");
    app.add_flag_callback(
        "-v,--verbose", [&] { arguments.verbosity = Verbosity::verbose; }, "Name every step");
    app.set_version_flag("-V,--version", "pbm-build " PBM_VERSION);
    return command_line::parse(app, kProgram, argc, argv, kBakingSwitches);
}

std::string megabytes(std::uint64_t bytes) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f MB", static_cast<double>(bytes) * 1e-6);
    return text.data();
}

// What became of the input, and what came out.
std::string report(const Arguments &arguments, const BuildStatistics &statistics) {
    std::string text;
    for (const AttributeReport &line : statistics.attributes)
        text += line.name + ": " + std::string(to_string(line.fate)) +
                (line.note.empty() ? "" : " (" + line.note + ")") + "\n";
    std::array<char, 256> line{};
    const auto add = [&](int length) {
        text.append(line.data(), std::min(line.size() - 1, static_cast<std::size_t>(length)));
    };
    if (arguments.verbosity == Verbosity::verbose)
        for (const StepStatistics &step : statistics.steps)
            add(std::snprintf(line.data(), line.size(), "%-14s %8.3f s, peak %s\n", step.name.c_str(), step.seconds,
                              megabytes(step.peak_memory).c_str()));
    text += arguments.output + ": ";
    add(std::snprintf(line.data(), line.size(),
                      "%llu points, depth %d, voxel size %.6g, %s, %.2f bits per point, %.3f of the input, %.2f s\n",
                      static_cast<unsigned long long>(statistics.points), statistics.depth, statistics.voxel_size,
                      megabytes(statistics.file_bytes).c_str(), statistics.bits_per_point(), statistics.ratio(),
                      statistics.seconds()));
    return text;
}

int run(Arguments &arguments) {
    if (arguments.output.empty())
        arguments.output = std::filesystem::path(arguments.input).replace_extension(".bvg").string();
    if (const auto refused =
            command_line::refuse_outputs(kProgram, {{arguments.input}}, {{arguments.output, arguments.json}}))
        return *refused;

    BuildStatistics statistics;
    {
        ProgressDisplay display(arguments.verbosity);
        const Progress progress = [&](std::string_view step, double done) { display.show(step, done); };
        const Result<Model> model = read_and_build(arguments.input, arguments.build, statistics, progress);
        display.clear();
        if (!model)
            return command_line::fail(kProgram, arguments.input, model.error());
        const Status written = write(arguments.output, model.value(), arguments.build, statistics, progress);
        display.clear();
        if (!written)
            return command_line::fail(kProgram, arguments.output, written.error());
    }
    if (arguments.verbosity != Verbosity::quiet && arguments.json != "-")
        std::cout << report(arguments, statistics);
    if (arguments.json.empty())
        return 0;
    const Status told =
        command_line::write_text(arguments.json, to_json(statistics, arguments.input, arguments.output));
    return told ? 0 : command_line::fail(kProgram, arguments.json, told.error());
}

} // namespace

int main(int argc, char **argv) {
    return command_line::run_program(kProgram, [&] {
        Arguments arguments;
        if (const auto done = parse(argc, argv, arguments))
            return *done;
        return run(arguments);
    });
}
