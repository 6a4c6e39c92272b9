#include "options.h"

#include "command_line/parse.h"
#include "pbm_format/layout.h"

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

} // namespace

std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Turns a scan (PLY, OBJ, STL, OFF) into a binary voxel grid (.bvg).\n"
                 "Exit codes: 0 done, 1 usage, 2 I/O, 3 damaged input, 4 memory, 5 unsupported.",
                 "pbm-build"};
    BuildOptions &options = arguments.build;
    app.add_option("INPUT", arguments.inputs, "Scan to read")->required()->expected(1);
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
        "-q,--quiet", [&] { arguments.verbosity = command_line::Verbosity::quiet; }, "Say nothing but errors");
    app.add_flag_callback(
        "-v,--verbose", [&] { arguments.verbosity = command_line::Verbosity::verbose; }, "Name every step");
    app.set_version_flag("-V,--version", "pbm-build " PBM_VERSION);
    return command_line::parse(app, program, argc, argv, kBakingSwitches);
}

} // namespace pbm::build
