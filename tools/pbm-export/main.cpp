// pbm-export: writes the points of a .pbvg file as PLY.
#include "command_line/common_options.h"
#include "command_line/json_report.h"
#include "command_line/scan_extensions.h"
#include "ply_points.h"
#include "system/files/file_names.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"
#include "system/processes/this_process.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <iostream>
#include <sstream>

namespace {

using namespace pbm;
using command_line::Verbosity;

constexpr std::string_view kProgram = "pbm-export";

struct Arguments {
    std::string input, output;
    std::string json;         // file, "-" for stdout, empty for none
    std::optional<int> level; // absent: the finest
    StreamOptions stream;
    PlyFormat format;
    Verbosity verbosity = Verbosity::normal;
};

struct Outcome {
    int level = 0;
    std::uint64_t points = 0, bytes = 0;
    std::vector<std::string> dropped; // attributes that PLY cannot hold
    double seconds = 0;
};

std::optional<int> parse(int argc, char **argv, Arguments &arguments) {
    command_line::CommandLine line{
        std::string(kProgram),
        "Writes the points of a binary voxel grid (.pbvg) as PLY.\n"
        "Each with its position, normal, radius, colour, material and fields, in the coordinates of the scan."};
    line.add("FILE", "Model whose points are wanted", &arguments.input, {.required = true});
    line.add("-o,--output", "PLY file to write, - for standard output", &arguments.output,
             {.type = "FILE", .required = true});
    line.add("--level", "Detail level 0..depth; default the finest", &arguments.level,
             {.type = "L", .check = command_line::Integers{0, kMaxDepth}});
    line.add("--ascii", "As text; default binary, little-endian", &arguments.format.ascii);
    line.add("--float", "Single precision, refused where it is not enough", &arguments.format.single_precision);
    command_line::add_threads(line, arguments.stream.threads);
    command_line::add_max_memory(line, arguments.stream.max_memory);
    command_line::add_json(line, arguments.json, "Statistics");
    command_line::add_quiet(line, arguments.verbosity);
    command_line::add_verbose(line, arguments.verbosity, "Name every step");
    line.add_version(PBM_VERSION);
    const command_line::Manual manual{
        .examples = {{"pbm-export scan.pbvg -o points.ply", "The points of the finest level."},
                     {"pbm-build points.ply --grid-like scan.pbvg -o again.pbvg", "The same model again."}},
        .logs_steps = true};
    return command_line::parse(line, argc, argv, {}, manual);
}

// Lights, shadows and solid textures do not fit into a point's row.
std::vector<std::string> left_out(const ModelParameters &parameters) {
    std::vector<std::string> lines;
    if (!parameters.lights.empty())
        lines.push_back(std::to_string(parameters.lights.size()) + " lights");
    if (parameters.attributes.lights > 0)
        lines.push_back("shadows of " + std::to_string(parameters.attributes.lights) + " lights");
    if (parameters.attributes.texture)
        lines.emplace_back("the solid texture");
    return lines;
}

// An error and the file that it concerns: input or output.
struct Failure {
    const std::string &path;
    Error error;
};

std::optional<Failure> write_points(const Arguments &arguments, Reader &reader, Outcome &outcome) {
    const std::string &input = arguments.input, &output = arguments.output;
    std::uint64_t count = 1;
    if (outcome.level > 0) {
        const Result<const LevelDirectory *> directory = reader.directory(outcome.level);
        if (!directory)
            return Failure{input, directory.error()};
        const Result<std::uint64_t> second_sides = count_sides(reader, outcome.level);
        if (!second_sides)
            return Failure{input, second_sides.error()};
        count = (*directory)->points + *second_sides;
    }
    const Result<PlyPoints> ply = PlyPoints::of(reader, outcome.level, count, arguments.format);
    if (!ply)
        return Failure{input, ply.error()};
    Result<FileReplacement> file = FileReplacement::begin(output);
    if (!file)
        return Failure{output, file.error()};
    std::optional<Error> not_written;
    const auto write = [&](ByteView bytes) {
        outcome.bytes += bytes.size();
        Status status = file->write(bytes);
        if (!status)
            not_written = status.error();
        return status;
    };
    command_line::ProgressDisplay display(arguments.verbosity);
    Status status = write(as_bytes(ply->header()));
    StreamOptions options = arguments.stream;
    options.level = outcome.level;
    if (status)
        status = stream_points(reader, options,
                               {ply->row_bytes(), [&](const PointBlock &block) { return ply->rows(block); }, write,
                                [&](double done) { display.show("export points", done); }});
    display.clear();
    if (status)
        status = write(as_bytes(ply->materials()));
    if (!status)
        return Failure{not_written ? output : input, status.error()};
    if (Status finished = file->finish(); !finished)
        return Failure{output, finished.error()};
    outcome.points = count;
    return std::nullopt;
}

std::string report(const Arguments &arguments, const Outcome &outcome) {
    std::ostringstream text;
    for (const std::string &what : outcome.dropped)
        text << what << ": dropped (PLY cannot hold them)\n";
    text.precision(2);
    text << std::fixed << command_line::printable(command_line::output_name(arguments.output)) << ": " << outcome.points
         << " points of level " << outcome.level << ", " << static_cast<double>(outcome.bytes) * 1e-6 << " MB, "
         << outcome.seconds << " s\n";
    return text.str();
}

std::string to_json(const Arguments &arguments, const Outcome &outcome) {
    const nlohmann::ordered_json json{{"input", arguments.input},
                                      {"output", arguments.output},
                                      {"level", outcome.level},
                                      {"points", outcome.points},
                                      {"file_bytes", outcome.bytes},
                                      {"encoding", arguments.format.ascii ? "ascii" : "binary_little_endian"},
                                      {"coordinates", arguments.format.single_precision ? "float" : "double"},
                                      {"dropped", outcome.dropped},
                                      {"seconds", outcome.seconds},
                                      {"peak_memory", peak_memory()}};
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

// Whether a file with this extension would be taken for a scan in another format.
bool is_other_format(std::string_view extension) {
    const auto &formats = command_line::kScanExtensions;
    return extension != ".ply" && (extension == ".csv" || extension == ".txt" ||
                                   std::find(formats.begin(), formats.end(), extension) != formats.end());
}

int run(int argc, char **argv) {
    Arguments arguments;
    if (const auto done = parse(argc, argv, arguments))
        return *done;
    if (const std::string extension = lower_extension(arguments.output); is_other_format(extension))
        return command_line::fail_usage(kProgram, arguments.output +
                                                      ": pbm-export writes PLY alone; name the output "
                                                      ".ply, and convert it to " +
                                                      extension + " with another program");
    const std::array<command_line::OutputFile, 2> outputs{{{"--output", arguments.output}, {"--json", arguments.json}}};
    if (const auto refused = command_line::refuse_outputs(kProgram, {{arguments.input}}, outputs))
        return *refused;
    const auto begin = std::chrono::steady_clock::now();
    const Result<MappedFile> file = MappedFile::open(arguments.input);
    if (!file)
        return command_line::fail(kProgram, arguments.input, file.error());
    Result<Reader> reader = Reader::open(file->bytes());
    if (!reader)
        return command_line::fail(kProgram, arguments.input, reader.error());
    if (arguments.level && *arguments.level > reader->depth())
        return command_line::fail_usage(kProgram, "--level: " + arguments.input + " has levels 0 to " +
                                                      std::to_string(reader->depth()));
    Outcome outcome{.level = arguments.level.value_or(reader->depth()), .dropped = left_out(reader->parameters())};
    if (const auto failure = write_points(arguments, *reader, outcome))
        return command_line::fail(kProgram, command_line::output_name(failure->path), failure->error);
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::ostream *const stream = command_line::report_stream(outputs);
    if (arguments.verbosity != Verbosity::quiet && stream != nullptr)
        *stream << report(arguments, outcome);
    if (arguments.json.empty())
        return 0;
    return command_line::write_json(kProgram, arguments.json, to_json(arguments, outcome));
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program(kProgram, [&] { return run(argc, argv); });
}
