// pbm-build: turns a scan into a binary voxel grid.
#include "pbm_build/pipeline.h"
#include "pbm_format/layout.h"
#include "pbm_format/platform.h"
#include "progress_display.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>
#include <optional>

#include <CLI/CLI.hpp>

namespace {

using namespace pbm;
using namespace pbm::build;

struct Arguments {
    std::string input, output;
    std::string json; // file, "-" for stdout, empty for none
    BuildOptions build;
    Verbosity verbosity = Verbosity::normal;
};

int fail(const std::string &message, int code) {
    std::cerr << "pbm-build: " << message << "\n";
    return code;
}

int fail(const std::string &file, const Error &error) {
    const std::string place = error.offset == 0 ? "" : " (offset " + std::to_string(error.offset) + ")";
    return fail(file + ": " + error.message + place, exit_code(error.code));
}

// Switches of the dissertation's program that bake something: they need a builder that can.
constexpr std::array<std::string_view, 4> kBakingSwitches{"-SHADOW", "-TEXTURE", "-BACKGROUND", "-ENVIRONMENT_MAP"};

std::optional<std::string_view> baking_switch(int argc, char **argv) {
    for (int i = 1; i < argc; ++i)
        for (const std::string_view name : kBakingSwitches)
            if (name == argv[i])
                return name;
    return std::nullopt;
}

// CLI11 wants the last argument first. A lone --json must not swallow the input's name.
std::vector<std::string> reversed_arguments(int argc, char **argv) {
    std::vector<std::string> reversed;
    for (int i = argc - 1; i > 0; --i)
        reversed.emplace_back(std::string_view(argv[i]) == "--json" ? "--json=-" : argv[i]);
    return reversed;
}

// Fills `arguments`, or returns the exit code of a program that has said all it had to say.
std::optional<int> parse(int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Turns a scan (PLY, OBJ, STL, OFF) into a binary voxel grid (.bvg).\n"
                 "Exit codes: 0 done, 1 usage, 2 I/O, 3 damaged input, 4 memory, 5 unsupported.",
                 "pbm-build"};
    BuildOptions &build = arguments.build;
    app.add_option("INPUT", arguments.input, "Scan to read")->required();
    app.add_option("-o,--output", arguments.output, "File to write; default: the input's name with .bvg");
    app.add_option("-j,--threads", build.threads, "Threads, 0 for all processors")->check(CLI::Range(0, 1024));
    auto *depth = app.add_option("--depth", build.grid.depth, "Depth: 2^N voxels per edge of the grid, 2..16")
                      ->check(CLI::Range(kMinDepth, kMaxDepth));
    auto *voxel_size = app.add_option("--voxel-size", build.grid.voxel_size,
                                      "Voxel edge in model units; the grid snaps to multiples of it")
                           ->check(CLI::PositiveNumber);
    auto *max_points = app.add_option("--max-points", build.grid.max_points, "Finest depth with at most so many points")
                           ->check(CLI::PositiveNumber);
    depth->excludes(voxel_size)->excludes(max_points);
    voxel_size->excludes(max_points);
    app.add_option("-z,--compression-level", build.compression_level, "zstd level 1..19")
        ->check(CLI::Range(1, 19))
        ->capture_default_str();
    app.add_option("--colour,--color", build.colour, "Bits of a colour")
        ->transform(CLI::CheckedTransformer(
            std::map<std::string, ColourFormat>{{"565", ColourFormat::rgb565}, {"888", ColourFormat::rgb888}}));
    app.add_option("--unit", build.grid.unit, "Unit of the coordinates")
        ->transform(CLI::CheckedTransformer(std::map<std::string, Unit>{{"unknown", Unit::unknown},
                                                                        {"m", Unit::metre},
                                                                        {"mm", Unit::millimetre},
                                                                        {"cm", Unit::centimetre},
                                                                        {"in", Unit::inch},
                                                                        {"ft", Unit::foot},
                                                                        {"km", Unit::kilometre}}));
    app.add_option("--up", build.grid.up, "Axis that points up; default y")
        ->transform(CLI::CheckedTransformer(
            std::map<std::string, UpAxis>{{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}}, CLI::ignore_case));
    app.add_option("--name", build.credits.name, "Name of the model, kept in the file");
    app.add_option("--licence,--license", build.credits.licence, "Licence, kept in the file");
    app.add_option("--credit", build.credits.credit, "Whom to credit, kept in the file");
    app.add_flag("--strict", build.strict, "Refuse the input if anything of it would be dropped");
    app.add_option("--json", arguments.json, "Statistics as JSON, to FILE or (--json alone) to stdout")
        ->type_name("[=FILE]");
    app.add_flag_callback(
        "-q,--quiet", [&] { arguments.verbosity = Verbosity::quiet; }, "Say nothing but errors");
    app.add_flag_callback(
        "-v,--verbose", [&] { arguments.verbosity = Verbosity::verbose; }, "Name every step");
    app.set_version_flag("-V,--version", std::string("pbm-build ") + PBM_BUILD_VERSION + " (bvg format " +
                                             std::to_string(kMajorVersion) + "." + std::to_string(kMinorVersion) + ")");
    try {
        app.parse(reversed_arguments(argc, argv));
    } catch (const CLI::Success &done) {
        return app.exit(done);
    } catch (const CLI::ParseError &error) {
        return fail(std::string(error.what()) + "; see pbm-build --help", 1);
    }
    return std::nullopt;
}

bool same_file(const std::string &a, const std::string &b) {
    std::error_code ignored;
    return a == b || std::filesystem::equivalent(a, b, ignored);
}

std::string megabytes(std::uint64_t bytes) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f MB", static_cast<double>(bytes) * 1e-6);
    return text.data();
}

void report(const Arguments &arguments, const BuildStatistics &statistics) {
    for (const AttributeReport &line : statistics.attributes)
        std::cout << line.name << ": " << to_string(line.fate) << (line.note.empty() ? "" : " (" + line.note + ")")
                  << "\n";
    if (arguments.verbosity == Verbosity::verbose)
        for (const StepStatistics &step : statistics.steps)
            std::printf("%-14s %8.3f s, peak %s\n", step.name.c_str(), step.seconds,
                        megabytes(step.peak_memory).c_str());
    std::cout << std::flush;
    std::printf("%s: %llu points, depth %d, voxel size %.6g, %s, %.2f bits per point, %.3f of the input, %.2f s\n",
                arguments.output.c_str(), static_cast<unsigned long long>(statistics.points), statistics.depth,
                statistics.voxel_size, megabytes(statistics.file_bytes).c_str(), statistics.bits_per_point(),
                statistics.ratio(), statistics.seconds());
    std::fflush(stdout);
}

int run(Arguments &arguments) {
    if (arguments.output.empty())
        arguments.output = std::filesystem::path(arguments.input).replace_extension(".bvg").string();
    if (same_file(arguments.input, arguments.output))
        return fail(arguments.output + ": the output is the input; choose another name with -o", 1);
    if (const Status replaceable = check_replaceable(arguments.output); !replaceable)
        return fail(arguments.output, replaceable.error());

    Result<BuildStatistics> built = [&] {
        ProgressDisplay display(arguments.verbosity);
        return build_file(arguments.input, arguments.output, arguments.build,
                          [&](std::string_view step, double done) { display.show(step, done); });
    }();
    if (!built)
        return fail(arguments.input, built.error());

    if (arguments.verbosity != Verbosity::quiet && arguments.json != "-")
        report(arguments, *built);
    if (arguments.json.empty())
        return 0;
    const std::string json = to_json(*built, arguments.input, arguments.output);
    if (arguments.json == "-") {
        std::cout << json << std::flush;
        return std::cout ? 0 : fail("stdout: cannot be written", 2);
    }
    const ByteView bytes(reinterpret_cast<const std::uint8_t *>(json.data()), json.size());
    if (const Status written = replace_file(arguments.json, bytes); !written)
        return fail(arguments.json, written.error());
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    make_write_errors_returns();
    Arguments arguments;
    try {
        if (const auto name = baking_switch(argc, argv))
            return fail(
                std::string(*name) + " is not in this version: it builds points, normals, radii and colours only", 5);
        if (const auto done = parse(argc, argv, arguments))
            return *done;
        return run(arguments);
    } catch (const std::bad_alloc &) {
        return fail(arguments.input + ": out of memory; choose a smaller --depth, or --max-points", 4);
    } catch (const std::exception &error) {
        return fail(arguments.input + ": " + error.what(), 4);
    }
}
