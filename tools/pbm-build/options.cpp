#include "options.h"

#include "command_line/common_options.h"
#include "command_line/settings_file.h"
#include "pbm_format/container/layout.h"
#include "recipe.h"
#include "scene_options.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

namespace pbm::build {
namespace {

// The spellings of compilers.
constexpr std::array<command_line::OldSwitch, 2> kCompilerSwitches{
    {{"-MD", "--write-dependencies"}, {"-MF", "--dependency-file"}}};

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
        return command_line::fail_usage(program, "several inputs need a name for what they become: -o FILE.pbvg");
    if (is_stream(arguments.inputs.front()))
        return command_line::fail_usage(program, "a stream has no name to take the output's from: -o FILE.pbvg");
    return std::nullopt;
}

// Options that say where things go, how fast and how loud: the result is the same whatever they are.
bool changes_result(const CLI::Option &option) {
    constexpr std::array<const char *, 13> kHarmless{
        "output",          "threads", "json",       "quiet",       "verbose", "log",    "write-dependencies",
        "dependency-file", "recipe",  "if-changed", "source-hash", "help",    "version"};
    return std::none_of(kHarmless.begin(), kHarmless.end(), [&](const char *name) { return option.check_lname(name); });
}

// Numbers in their shortest spelling; several stand between commas.
std::string in_one_spelling(const CLI::Option &option, const std::string &text) {
    if (command_line::names_file(option, text)) // its content counts, and its extension, which can say how it is read
        return std::filesystem::path(text).extension().string();
    if (option.get_type_name() == "TEXT")
        return text;
    std::string result;
    for (const std::string &part : CLI::detail::split(text, ',')) {
        double number = 0;
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
        std::array<char, 32> shortest{};
        const auto shortest_end = std::to_chars(shortest.data(), shortest.data() + shortest.size(), number).ptr;
        const bool is_number = error == std::errc() && end == part.data() + part.size();
        result += (result.empty() ? "" : ",") + (is_number ? std::string(shortest.data(), shortest_end) : part);
    }
    return result;
}

// An option that is added later is part of the request, and its file is a source, unless changes_result says otherwise.
void describe_request(const CLI::App &app, Arguments &arguments) {
    for (const CLI::Option *option : app.get_options()) {
        if (!changes_result(*option))
            continue;
        for (const std::string &text : option->results()) {
            arguments.request += option->get_name() + "=" + in_one_spelling(*option, text) + '\n';
            if (command_line::names_file(*option, text))
                arguments.sources.push_back(text);
        }
    }
}

void add_input_options(CLI::App &app, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    app.option_defaults()->group("Input");
    app.add_option("INPUT", arguments.inputs, "Scans to read, merged if several; - for standard input")->required();
    add_choice<Unit>(app, "--unit", options.grid.unit,
                     {{"unknown", Unit::unknown},
                      {"m", Unit::metre},
                      {"mm", Unit::millimetre},
                      {"cm", Unit::centimetre},
                      {"in", Unit::inch},
                      {"ft", Unit::foot},
                      {"km", Unit::kilometre}},
                     "Unit of the coordinates; default unknown");
    add_choice<UpAxis>(app, "--up", options.grid.up, {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
                       "Axis that points up; default y");
    app.add_option_function<double>(
           "--scale", [&](double scale) { options.placement.scale = scale; },
           "Factor from the input's coordinates and radii to the model's")
        ->check(positive);
    app.add_option_function<std::string>(
           "--origin", [&](const std::string &place) { options.placement.origin = three_numbers(place); },
           "Place of the input's origin in the model; added after --scale")
        ->check([](const std::string &text) {
            return three_numbers(text) ? "" : "Value " + text + " is not X,Y,Z: three finite numbers";
        })
        ->type_name("X,Y,Z");
    add_choice<std::optional<ScanFormat>>(
        app, "--input-format", options.input_format,
        {{"ply", ScanFormat::ply}, {"obj", ScanFormat::obj}, {"off", ScanFormat::off}, {"stl", ScanFormat::stl}},
        "Format of inputs that show it neither in content nor in name");
    app.add_flag("--flip-faces", options.flip_faces, "Turn all faces around: for scans that look inside out");
    app.add_option_function<std::string>(
           "--viewpoint", [&](const std::string &place) { options.viewpoint = three_numbers(place); },
           "Where the scanner stood, in the model: estimated normals are turned to it")
        ->check([](const std::string &text) {
            return three_numbers(text) ? "" : "Value " + text + " is not X,Y,Z: three finite numbers";
        })
        ->type_name("X,Y,Z");
    auto *remove_outliers =
        app.add_flag("--remove-outliers", options.remove_outliers, "Drop points without faces far from all others");
    app.add_flag("--strict", options.strict, "Refuse the input if anything of it would be dropped")
        ->excludes(remove_outliers);
}

void add_grid_options(CLI::App &app, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    app.option_defaults()->group("Grid");
    auto *depth = app.add_option("--depth", options.grid.depth, "Depth: 2^N voxels per edge of the grid, 5..16")
                      ->check(CLI::Range(kMinBuildDepth, kMaxDepth));
    auto *voxel_size = app.add_option("--voxel-size", options.grid.voxel_size,
                                      "Voxel edge in model units; the grid snaps to multiples of it")
                           ->check(positive);
    auto *max_points = app.add_option("--max-points", options.grid.max_points,
                                      "Depth with at most so many points, estimated from the area")
                           ->check(positive);
    auto *grid_like =
        app.add_option("--grid-like", arguments.grid_like, "Very same grid, unit and up axis as this .pbvg file")
            ->type_name("FILE");
    depth->excludes(voxel_size)->excludes(max_points);
    voxel_size->excludes(max_points);
    grid_like->excludes(depth)->excludes(voxel_size)->excludes(max_points);
    grid_like->excludes(app.get_option("--unit"))->excludes(app.get_option("--up"));
}

void add_output_options(CLI::App &app, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    app.option_defaults()->group("Output");
    app.add_option("-o,--output", arguments.output,
                   "File to write, - for standard output; default: the one input's name with .pbvg")
        ->type_name("FILE");
    app.add_option("-z,--compression-level", options.compression_level, "zstd level 1..19")
        ->check(CLI::Range(1, 19))
        ->capture_default_str();
    add_choice<Storage>(app, "--store", options.storage, {{"packed", Storage::packed}, {"mapped", Storage::mapped}},
                        "Small, or raw to be drawn where it lies; default packed");
    add_choice<ColourFormat>(app, "--colour,--color", options.colour,
                             {{"565", ColourFormat::rgb565}, {"888", ColourFormat::rgb888}},
                             "Bits of a colour; default 888");
    app.add_option("--name", options.credits.name, "Name of the model, kept in the file");
    app.add_option("--licence,--license", options.credits.licence, "Licence, kept in the file");
    app.add_option("--credit", options.credits.credit, "Whom to credit, kept in the file");
}

void add_build_system_options(CLI::App &app, Arguments &arguments) {
    app.option_defaults()->group("Build systems");
    command_line::add_settings_file(app, "--recipe", "Take the options from a TOML file; the command line wins over it",
                                    read_recipe);
    app.add_flag(
        "--if-changed", arguments.if_changed,
        "Build only if the output is not what the input and options would give, and leave it and its time "
        "alone if it turns out the same. An input that did not change is read, not built. Keeps --source-hash");
    app.add_flag("--source-hash", arguments.source_hash,
                 "Keep hashes (XXH3) of the input and of the options in the file's metadata");
    app.add_flag("--write-dependencies", arguments.depfile,
                 "Write what was read, for Make and Ninja, to the output's name with .d");
    app.add_option("--dependency-file", arguments.depfile_name, "The same, to FILE")->type_name("FILE");
}

void add_general_options(CLI::App &app, Arguments &arguments) {
    app.option_defaults()->group("General");
    command_line::add_threads(app, arguments.build.threads);
    command_line::add_json(app, arguments.json, "Statistics");
    command_line::add_quiet(app, arguments.verbosity);
    command_line::add_verbose(app, arguments.verbosity, "Name every step");
    app.set_version_flag("-V,--version", "pbm-build " PBM_VERSION);
}

} // namespace

std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    CLI::App app{"Turns a scan (PLY, OBJ, STL, OFF) into a binary voxel grid (.pbvg).\n"
                 "Says of every attribute of the scan whether it was kept, converted or dropped.\n"
                 "In a recipe every long option is a key without its dashes (depth = 9), INPUT is input, lights and "
                 "materials may be tables ([[light]]), and names of files are relative to the recipe's folder. The "
                 "command line wins over the recipe.",
                 "pbm-build"};
    add_input_options(app, arguments);
    add_grid_options(app, arguments);
    SceneArguments scene;
    add_scene_options(app, scene);
    add_output_options(app, arguments);
    add_build_system_options(app, arguments);
    add_general_options(app, arguments);
    const command_line::Manual manual{
        .most_used = {"--output", "--depth", "--unit", "--up", "--recipe", "--help"},
        .examples = {{"pbm-build scan.ply -o scan.pbvg", "A scan at the depth that fits its points."},
                     {"pbm-build left.ply right.ply --depth 10 --unit mm --up z --strict -o scan.pbvg",
                      "Two scans as one model of at most 1,024 voxels per edge; an error if anything of them would be "
                      "dropped."},
                     {"pbm-build scan.ply --lights studio --shadows --ground wood --panorama default -o scan.pbvg",
                      "With shadows on a wooden floor, under a sky."},
                     {"pbm-build --recipe scan.toml --if-changed -MF scan.d -o scan.pbvg", "As build systems call it."}},
        .logs_steps = true};
    std::vector<command_line::OldSwitch> switches(kCompilerSwitches.begin(), kCompilerSwitches.end());
    switches.insert(switches.end(), scene_switches().begin(), scene_switches().end());
    std::vector<std::string> words = with_optional_values(argc, argv);
    std::vector<char *> pointers;
    pointers.reserve(words.size());
    for (std::string &word : words)
        pointers.push_back(word.data());
    if (const auto done =
            command_line::parse(app, program, static_cast<int>(pointers.size()), pointers.data(), switches, manual))
        return done;
    Result<SceneRequest> request = scene_request(app, scene);
    if (!request)
        return command_line::fail_usage(program, request.error().message);
    arguments.build.scene = std::move(*request);
    if (const auto refused = check_inputs(program, arguments))
        return refused;
    arguments.depfile = arguments.depfile || !arguments.depfile_name.empty();
    const auto recipe = app.get_config_ptr()->results();
    arguments.recipe = recipe.empty() ? "" : recipe.back();
    describe_request(app, arguments);
    return std::nullopt;
}

} // namespace pbm::build
