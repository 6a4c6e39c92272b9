#include "options.h"

#include "command_line/parse.h"
#include "pbm_format/layout.h"
#include "pbm_format/platform.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

namespace pbm::build {
namespace {

// Switches of the dissertation's program that bake something: they need a builder that can.
constexpr std::array<command_line::OldSwitch, 4> kBakingSwitches{
    {{"-SHADOW", ""}, {"-TEXTURE", ""}, {"-BACKGROUND", ""}, {"-ENVIRONMENT_MAP", ""}}};

// An option that takes one of some words.
template <class T>
CLI::Option *add_choice(CLI::App &app, const std::string &names, T &value, const std::map<std::string, T> &words,
                        const std::string &help) {
    std::vector<std::string> known;
    known.reserve(words.size());
    for (const auto &[word, meaning] : words)
        known.push_back(word);
    return app
        .add_option_function<std::string>(
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

// "X,Y,Z", nothing where it is not that.
std::optional<std::array<double, 3>> three_numbers(const std::string &text) {
    std::array<double, 3> values{};
    const char *at = text.data(), *const end = at + text.size();
    for (std::size_t i = 0; i < 3; ++i) {
        const auto [stop, failure] = std::from_chars(at, end, values[i]);
        const bool separated = i == 2 ? stop == end : stop != end && *stop == ',';
        if (failure != std::errc() || !separated || !std::isfinite(values[i]))
            return std::nullopt;
        at = stop + 1;
    }
    return values;
}

// What CLI11 cannot say about the inputs.
std::optional<int> check_inputs(std::string_view program, const Arguments &arguments) {
    const auto streams = std::count(arguments.inputs.begin(), arguments.inputs.end(), "-");
    if (streams > 1)
        return command_line::fail_usage(program, "standard input (-) can be read only once");
    if (!arguments.output.empty())
        return std::nullopt;
    if (arguments.inputs.size() > 1)
        return command_line::fail_usage(program, "several inputs need a name for what they become: -o FILE.bvg");
    if (is_stream(arguments.inputs.front()))
        return command_line::fail_usage(program, "a stream has no name to take the output's from: -o FILE.bvg");
    return std::nullopt;
}

} // namespace

std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Turns a scan (PLY, OBJ, STL, OFF) into a binary voxel grid (.bvg).\n"
                 "Exit codes: 0 done, 1 usage, 2 I/O, 3 damaged input, 4 memory, 5 unsupported.",
                 "pbm-build"};
    BuildOptions &options = arguments.build;
    app.add_option("INPUT", arguments.inputs, "Scans to read, merged if several; - for standard input")->required();
    app.add_option("-o,--output", arguments.output, "File to write; default: the one input's name with .bvg");
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
    auto *grid_like =
        app.add_option("--grid-like", arguments.grid_like, "Very same grid, unit and up axis as this .bvg file");
    grid_like->excludes(depth)->excludes(voxel_size)->excludes(max_points);
    app.add_option("-z,--compression-level", options.compression_level, "zstd level 1..19")
        ->check(CLI::Range(1, 19))
        ->capture_default_str();
    add_choice<ColourFormat>(app, "--colour,--color", options.colour,
                             {{"565", ColourFormat::rgb565}, {"888", ColourFormat::rgb888}},
                             "Bits of a colour; default 888");
    auto *unit = add_choice<Unit>(app, "--unit", options.grid.unit,
                                  {{"unknown", Unit::unknown},
                                   {"m", Unit::metre},
                                   {"mm", Unit::millimetre},
                                   {"cm", Unit::centimetre},
                                   {"in", Unit::inch},
                                   {"ft", Unit::foot},
                                   {"km", Unit::kilometre}},
                                  "Unit of the coordinates");
    auto *up = add_choice<UpAxis>(app, "--up", options.grid.up, {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
                                  "Axis that points up; default y");
    grid_like->excludes(unit)->excludes(up);
    app.add_option_function<double>(
           "--scale", [&](double scale) { options.placement.scale = scale; },
           "Factor from the input's coordinates and radii to the model's")
        ->check(positive);
    app.add_option_function<std::string>(
           "--origin", [&](const std::string &place) { options.placement.origin = three_numbers(place); },
           "X,Y,Z of the input's origin in the model; added after --scale")
        ->check([](const std::string &text) {
            return three_numbers(text) ? "" : "Value " + text + " is not X,Y,Z: three finite numbers";
        });
    add_choice<std::optional<ScanFormat>>(
        app, "--input-format", options.input_format,
        {{"ply", ScanFormat::ply}, {"obj", ScanFormat::obj}, {"off", ScanFormat::off}, {"stl", ScanFormat::stl}},
        "Format of inputs that show it neither in content nor in name");
    app.add_option("--name", options.credits.name, "Name of the model, kept in the file");
    app.add_option("--licence,--license", options.credits.licence, "Licence, kept in the file");
    app.add_option("--credit", options.credits.credit, "Whom to credit, kept in the file");
    app.add_flag("--flip-faces", options.flip_faces, "Turn all faces around: for scans that look inside out");
    app.add_flag("--strict", options.strict, "Refuse the input if anything of it would be dropped");
    app.add_option("--json", arguments.json, "Statistics as JSON, to FILE or (--json alone) to stdout")
        ->type_name("[=FILE]");
    app.add_flag_callback(
        "-q,--quiet", [&] { arguments.verbosity = command_line::Verbosity::quiet; }, "Say nothing but errors");
    app.add_flag_callback(
        "-v,--verbose", [&] { arguments.verbosity = command_line::Verbosity::verbose; }, "Name every step");
    app.set_version_flag("-V,--version", "pbm-build " PBM_VERSION);
    if (const auto done = command_line::parse(app, program, argc, argv, kBakingSwitches))
        return done;
    return check_inputs(program, arguments);
}

} // namespace pbm::build
