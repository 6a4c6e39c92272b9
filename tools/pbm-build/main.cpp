// pbm-build: turns a scan into a binary voxel grid.
#include "command_line/command_line.h"
#include "options.h"
#include "pbm_build/pipeline.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>

namespace {

using namespace pbm;
using namespace pbm::build;

constexpr std::string_view kProgram = "pbm-build";

std::string megabytes(std::uint64_t bytes) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f MB", static_cast<double>(bytes) * 1e-6);
    return text.data();
}

// What became of the input, and what came out.
std::string report(const Arguments &arguments, const BuildStatistics &statistics) {
    std::string text;
    for (const AttributeReport &line : statistics.attributes)
        text += (line.input.empty() ? "" : line.input + ": ") + line.name + ": " + std::string(to_string(line.fate)) +
                (line.note.empty() ? "" : " (" + line.note + ")") + "\n";
    std::array<char, 256> line{};
    const auto add = [&](int length) {
        text.append(line.data(), std::min(line.size() - 1, static_cast<std::size_t>(length)));
    };
    if (arguments.verbosity == command_line::Verbosity::verbose)
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
        arguments.output = std::filesystem::path(arguments.inputs.front()).replace_extension(".bvg").string();
    std::vector<std::string> read = arguments.inputs;
    if (!arguments.grid_like.empty())
        read.push_back(arguments.grid_like);
    if (const auto refused = command_line::refuse_outputs(kProgram, read, {{arguments.output, arguments.json}}))
        return *refused;
    if (!arguments.grid_like.empty()) {
        Result<Grid> grid = read_grid(arguments.grid_like);
        if (!grid)
            return command_line::fail(kProgram, arguments.grid_like, grid.error());
        arguments.build.grid.like = *grid;
    }

    BuildStatistics statistics;
    {
        command_line::ProgressDisplay display(arguments.verbosity);
        const Progress progress = [&](std::string_view step, double done) { display.show(step, done); };
        const Result<Model> model = read_and_build(arguments.inputs, arguments.build, statistics, progress);
        display.clear();
        if (!model)
            return command_line::fail(kProgram, arguments.inputs.size() > 1 ? "" : arguments.inputs.front(),
                                      model.error());
        const Status written = write(arguments.output, model.value(), arguments.build, statistics, progress);
        display.clear();
        if (!written)
            return command_line::fail(kProgram, arguments.output, written.error());
    }
    if (arguments.verbosity != command_line::Verbosity::quiet && arguments.json != "-")
        std::cout << report(arguments, statistics);
    if (arguments.json.empty())
        return 0;
    const Status told =
        command_line::write_text(arguments.json, to_json(statistics, arguments.inputs, arguments.output));
    return told ? 0 : command_line::fail(kProgram, arguments.json, told.error());
}

} // namespace

int main(int argc, char **argv) {
    return command_line::run_program(kProgram, [&] {
        Arguments arguments;
        if (const auto done = parse(kProgram, argc, argv, arguments))
            return *done;
        return run(arguments);
    });
}
