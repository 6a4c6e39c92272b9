#include "options.h"

#include "command_line/common_options.h"
#include "pbm_build/upsampling/upsample.h"
#include "pbm_format/model/las_classes.h"
#include "pbm_scan/formats.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/table/text_cloud.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"
#include "pbm_scan/text/words.h"
#include "recipe.h"
#include "scene_options.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"
#include "warning_options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

namespace pbm::build {
namespace {

using command_line::CommandLine;

// The spellings of compilers, and of the dissertation's program.
constexpr std::array<command_line::OldSwitch, 8> kSwitches{{{"-MD", "--write-dependencies"},
                                                            {"-MF", "--dependency-file"},
                                                            {"-MQ", "--dependency-target"},
                                                            {"-SHADOW", "--shadows"},
                                                            {"-TEXTURE", "--texture"},
                                                            {"-IGNORE_POINT_COLOURS", "--ignore-point-colours"},
                                                            {"-ENVIRONMENT_MAP", "--environment-map"},
                                                            {"-BACKGROUND", "--panorama"}}};

// An option that takes one of some words.
template <class T>
void add_choice(CommandLine &line, const char *names, T &value, const std::map<std::string, T> &words,
                const char *help) {
    command_line::Words known;
    known.reserve(words.size());
    for (const auto &[word, meaning] : words)
        known.push_back(word);
    line.add(names, help,
             [&value, words](const std::string &word) -> Status { return value = words.at(word), Status(); },
             {.check = std::move(known)});
}

// CLI11's own check prints the range of a double, 300 digits.
std::string positive(const std::string &text) {
    const auto value = parse_all<double>(text);
    return value && *value > 0 && std::isfinite(*value) ? "" : "Value " + text + " is not a positive number";
}

Result<double> alpha_cutoff(const std::string &text) {
    if (text == "none")
        return 0.0;
    const auto value = parse_all<double>(text);
    if (!value || !(*value >= 0 && *value <= 1))
        return usage_error("Value " + text + " is neither none nor a number of 0 to 1");
    return *value;
}

std::string angle(const std::string &text) {
    const auto value = parse_all<double>(text);
    return value && *value >= 0 && *value <= 180 ? "" : "Value " + text + " is not an angle of 0 to 180 degrees";
}

// "X,Y,Z".
Result<std::array<double, 3>> three_numbers(const std::string &text) {
    std::array<double, 3> values{};
    const auto parts = split(text);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const auto value = parse_all<double>(parts[i]);
        if (parts.size() != 3 || !value || !std::isfinite(*value))
            return usage_error("Value " + text + " is not X,Y,Z: three finite numbers");
        values[i] = *value;
    }
    return values;
}

// Handles --list-warnings, which needs no input, and takes --allow.
std::optional<int> take_warnings(std::string_view program, Arguments &arguments) {
    if (!arguments.list_warnings.empty()) {
        if (arguments.list_warnings != "text" && arguments.list_warnings != "markdown")
            return command_line::fail_usage(program, "--list-warnings: write text or markdown");
        print_warnings(arguments.list_warnings == "markdown");
        return 0;
    }
    arguments.allowed = warnings_named(arguments.allow);
    for (const std::string &word : arguments.allow)
        if (contains(arguments.build.denied, find_warning(word)))
            return command_line::fail_usage(program, "--deny and --allow both name " + word + ": leave one out");
    return std::nullopt;
}

// False for options of destination, speed and output, which do not affect the result.
bool changes_result(const command_line::GivenValue &option) {
    constexpr std::array<std::string_view, 37> kHarmless{{"--temp-dir",
                                                          "--batch-root",
                                                          "--keep-extension",
                                                          "--page",
                                                          "--page-view",
                                                          "--action-key",
                                                          "--allow",
                                                          "--list-warnings",
                                                          "--shard",
                                                          "--shards",
                                                          "--merge",
                                                          "--plan",
                                                          "--cache",
                                                          "--cache-size",
                                                          "--batch",
                                                          "--output-dir",
                                                          "--keep-going",
                                                          "--timeout",
                                                          "--max-memory",
                                                          "--output",
                                                          "--threads",
                                                          "--json",
                                                          "--mesh-report",
                                                          "--quiet",
                                                          "--warnings",
                                                          "--verbose",
                                                          "--log",
                                                          "--write-dependencies",
                                                          "--dependency-file",
                                                          "--dependency-target",
                                                          "--recipe",
                                                          "--allow-outside",
                                                          "--if-changed",
                                                          "--source-hash",
                                                          "--progress",
                                                          "--help",
                                                          "--version"}};
    return std::find(kHarmless.begin(), kHarmless.end(), option.name) == kHarmless.end();
}

Result<PartNumber> parse_shard(const std::string &text) {
    const std::size_t slash = std::min(text.find('/'), text.size());
    const auto index = parse_all<std::uint64_t>(std::string_view(text).substr(0, slash));
    const auto count = parse_all<std::uint64_t>(std::string_view(text).substr(std::min(slash + 1, text.size())));
    if (!index || !count || *index >= *count)
        return usage_error("'" + text + "' is no shard; write I/N with I from 0 to N - 1, like 0/8");
    return PartNumber{*index, *count};
}

bool is_one_of(std::string_view name, std::span<const std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// Collects the options that each build of a batch or plan gets.
void collect_forwarded(const CommandLine &line, Arguments &arguments) {
    constexpr std::array<std::string_view, 10> kOfAll{
        "--cache",  "--cache-size", "--if-changed",    "--source-hash", "--write-dependencies",
        "--recipe", "--allow",      "--allow-outside", "--mesh-report", "--temp-dir"};
    for (const command_line::GivenValue &option : line.given)
        if (option.name != "INPUT" && !option.is_setting && (changes_result(option) || is_one_of(option.name, kOfAll)))
            arguments.forwarded.push_back(option.name + "=" + option.value);
}

// Verifies the options of a batch.
std::optional<int> take_batch(const CommandLine &line, Arguments &arguments) {
    if (arguments.output_folder.empty())
        return command_line::fail_usage(line.program, "--batch needs a folder for what it builds: --output-dir DIR");
    if (std::error_code none; !arguments.batch_root.empty() && std::filesystem::is_directory(arguments.batch, none))
        return command_line::fail_usage(line.program, "--batch-root is for a list: a folder is its own root");
    if (!arguments.inputs.empty() || !arguments.output.empty())
        return command_line::fail_usage(line.program, "--batch takes its scans from a list or a folder, and names its "
                                                      "models itself: leave INPUT and --output out, of a recipe too");
    constexpr std::array<std::string_view, 4> kOfOneBuild{"--dependency-file", "--dependency-target", "--pose",
                                                          "--viewpoint"};
    for (const command_line::GivenValue &option : line.given)
        if (is_one_of(option.name, kOfOneBuild) && (option.name != "--viewpoint" || arguments.viewpoints.size() > 1))
            return command_line::fail_usage(line.program, option.name + " is of one scan, not of a --batch");
    collect_forwarded(line, arguments);
    return std::nullopt;
}

// Verifies what several processes can build together.
std::optional<int> check_parts(const CommandLine &line, const Arguments &arguments) {
    if (!arguments.plan.empty() && arguments.shards == 0)
        return command_line::fail_usage(line.program, "--plan is of a --batch, or of one model in --shards N parts");
    if (arguments.shard.count == 1 && arguments.shards == 0 && arguments.merged == 0)
        return std::nullopt;
    if (arguments.shard.count > kMaxTasks)
        return command_line::fail_usage(line.program,
                                        "--shard: a model has at most " + std::to_string(kMaxTasks) + " parts");
    if (arguments.build.grid.max_points)
        return command_line::fail_usage(line.program,
                                        "parts of a model need a grid that each of them knows: --depth or "
                                        "--voxel-size instead of --max-points");
    if (arguments.build.mesh.report)
        return command_line::fail_usage(line.program, "--mesh-report is of a whole build, not of parts");
    if (is_stream(arguments.output))
        return command_line::fail_usage(line.program, "parts lie beside the model: name it with -o");
    return std::nullopt;
}

// Verifies combinations of inputs and output.
std::optional<int> check_inputs(std::string_view program, const Arguments &arguments) {
    if (arguments.inputs.empty())
        return command_line::fail_usage(program, "INPUT is required");
    const auto streams = std::count(arguments.inputs.begin(), arguments.inputs.end(), "-");
    if (streams > 1)
        return command_line::fail_usage(program, "standard input (-) can be read only once");
    if (arguments.viewpoints.size() > 1 && arguments.viewpoints.size() != arguments.inputs.size())
        return command_line::fail_usage(program, "--viewpoint is given " + std::to_string(arguments.viewpoints.size()) +
                                                     " times for " + std::to_string(arguments.inputs.size()) +
                                                     " inputs: give one for all, or one for each");
    if (!arguments.output.empty())
        return std::nullopt;
    if (arguments.inputs.size() > 1)
        return command_line::fail_usage(program,
                                        "several inputs need a name for what they become: -o FILE.pbvg (--batch "
                                        "builds a model of each)");
    if (is_stream(arguments.inputs.front()))
        return command_line::fail_usage(program, "a stream has no name to take the output's from: -o FILE.pbvg");
    return std::nullopt;
}

// Names the output after the input, unless a recipe would write outside its folder by that.
std::optional<int> name_output(const CommandLine &line, Arguments &arguments) {
    if (!arguments.output.empty())
        return std::nullopt;
    const std::string &input = arguments.inputs.front();
    std::filesystem::path output(uncompressed_name(input));
    if (!arguments.page.empty())
        output = std::filesystem::path(arguments.page) / output.filename();
    arguments.output = output.replace_extension(".pbvg").string();
    if (arguments.output == input)
        return command_line::fail_usage(line.program, input + ": named like a model that is built already; draw it "
                                                              "with pbm-render, or name the output with -o");
    const bool by_recipe = std::any_of(line.given.begin(), line.given.end(),
                                       [](const auto &option) { return option.name == "INPUT" && option.is_setting; });
    if (!by_recipe || arguments.allow_outside || command_line::is_below(arguments.output, arguments.recipe))
        return std::nullopt;
    return command_line::fail(line.program, arguments.recipe,
                              usage_error("the output " + arguments.output +
                                          ", named after the input, lies outside the "
                                          "folder of this file; name it with -o, or allow that with --allow-outside"));
}

// The value with numbers, also those between commas, in their shortest spelling.
std::string in_one_spelling(const command_line::GivenValue &option) {
    if (option.is_file) // of its name only the extension affects the result
        return std::filesystem::path(option.value).extension().string();
    if (option.type == "TEXT")
        return option.value;
    std::string result, part;
    for (std::istringstream parts(option.value); std::getline(parts, part, ',');) {
        const auto number = parse_all<double>(part);
        result += (result.empty() ? "" : ",") + (number ? shortest_text(*number) : part);
    }
    return result;
}

// Collects the options that affect the result as the request, and their files as sources.
void describe_request(const CommandLine &line, Arguments &arguments) {
    for (const command_line::GivenValue &option : line.given) {
        if (option.name == "--recipe")
            arguments.recipe = option.value;
        if (!changes_result(option))
            continue;
        arguments.request += option.name + "=" + in_one_spelling(option) + '\n';
        if (option.is_file)
            arguments.sources.push_back(option.value);
    }
}

void add_input_options(CommandLine &line, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    line.topic = "Input";
    add_choice<std::optional<Unit>>(line, "--unit", options.grid.unit,
                                    {{"unknown", Unit::unknown},
                                     {"m", Unit::metre},
                                     {"mm", Unit::millimetre},
                                     {"cm", Unit::centimetre},
                                     {"in", Unit::inch},
                                     {"ft", Unit::foot},
                                     {"km", Unit::kilometre}},
                                    "Unit of coordinates; default: that of the format");
    add_choice<std::optional<UpAxis>>(line, "--up", options.grid.up,
                                      {{"auto", std::nullopt}, {"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
                                      "Axis that points up; default: by format, then scan");
    line.add("--geographic", "x and y are degrees: convert them to metres", &options.is_geographic);
    line.add("--scale", "Factor from the input's lengths to the model's", &options.placement.scale,
             {.check = positive});
    line.add("--origin", "Place of the input's origin in the model; added after --scale",
             command_line::stored(three_numbers, options.placement.origin),
             {.type = "X,Y,Z", .check = command_line::readable(three_numbers)});
    line.add("--pose",
             "Matrix from the input's coordinates to those of all (4 x 4); one for each input, in their order",
             &options.poses, {.type = "FILE"});
    std::map<std::string, const ScanFormat *> formats;
    for (const ScanFormat &format : scan_formats())
        formats.emplace(format.name, &format);
    add_choice<const ScanFormat *>(line, "--input-format", options.input_format, formats,
                                   "Format of inputs that show it neither in content nor in name");
    line.add("--columns", "What the columns of a table of points are, like x,y,z,-,r,g,b,label; - skips one",
             command_line::stored(parse_columns, options.columns),
             {.type = "LIST", .check = command_line::readable(parse_columns)});
    line.add("--viewpoint",
             "Where the scanner stood, in the model: estimated normals face it; once for all inputs, or for each",
             &arguments.viewpoints, {.type = "X,Y,Z", .check = command_line::readable(three_numbers)});
    line.add("--remove-outliers",
             "Drop points far from all others; default: points and faces that make the grid 10 times larger",
             [&options] { options.outliers = Outliers::drop; });
    line.add("--keep-outliers", "Drop none of them", [&options] { options.outliers = Outliers::keep; },
             {.excludes = {"--remove-outliers"}});
    line.add("--upsample",
             "Fill gaps of up to N voxels between points without faces with points on their surface, 2..16",
             &options.upsample, {.check = command_line::Integers{kMinGap, kMaxGap}});
    line.add("--strict", "Refuse the input if anything of it would be dropped", &options.strict,
             {.excludes = {"--remove-outliers"}});
    line.add("--deny", "Refuse scans whose report has lines of these names", &arguments.deny,
             {.type = "NAME,..", .check = undeniable_warning, .separator = ',', .proposals = [] {
                  return warning_names(true);
              }});
}

// Why no build keeps this field by itself; empty: it does.
std::string not_usual(const std::string &name) {
    const bool is_usual = std::find(kUsualFields.begin(), kUsualFields.end(), name) != kUsualFields.end();
    return is_usual ? ""
                    : "'" + printable(name) + "'" +
                          " is not kept by default; those are classification, intensity, return_number";
}

void add_field_options(CommandLine &line, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    line.topic = "Measurements";
    line.add("--field",
             "Keep a measurement of the points, up to 8: intensity, classification, gps_time ...; say its range, its "
             "average (mean, majority, max) and its bits (8, 16)",
             &arguments.fields,
             {.type = "NAME[=MIN,MAX][,mean|majority|max][,8|16]", .check = command_line::readable(parse_field)});
    line.add("--drop-field",
             "Keep no field of class, intensity or return number, which laser scans get where they vary",
             &options.dropped_fields, {.type = "NAME,..", .check = not_usual, .separator = ',', .proposals = [] {
                                           return std::vector<std::string>(kUsualFields.begin(), kUsualFields.end());
                                       }});
    line.add("--drop-class", "Leave out points of these classes: numbers, or names such as noise,water",
             command_line::stored(parse_classes, options.dropped_classes),
             {.type = "LIST", .check = command_line::readable(parse_classes)});
    line.add("--min-opacity", "Leave out Gaussian splats that are fainter, 0..1; default 0.2; the others are opaque",
             &options.min_opacity, {.check = command_line::Numbers{0, 1}});
    line.add("--keep-placeholders", "Keep points that stand for no measurement: 0 0 0 of rays without an echo, -9999",
             &options.keep_placeholders);
}

void add_mesh_options(CommandLine &line, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    line.topic = "Mesh";
    line.add("--mesh-report", "Say how the faces are connected: parts, borders, winding, what is no manifold",
             &options.mesh.report);
    WindingRequest &winding = options.mesh.winding;
    line.add("--orient-faces",
             "Wind faces alike, and outwards where they enclose a volume: the default without --flip-faces",
             &winding.requested);
    line.add("--no-orient-faces", "Leave faces and given normals as they are, also where they look inwards",
             &winding.keep, {.excludes = {"--orient-faces"}});
    line.add("--flip-faces",
             "Turn all faces around as they are wound in the file; after --orient-faces if both are given",
             &winding.flip);
    line.add("--drop-parts",
             "Drop parts that are smaller: than 1% of the area of the largest one, or than 200 faces, say",
             command_line::stored(parse_part_size, options.mesh.smallest_part),
             {.type = "SIZE", .check = command_line::readable(parse_part_size)});
    line.add("--fill-holes", "Close loops of the border that have at most N edges, 3..1000",
             &options.mesh.max_hole_edges, {.check = command_line::Integers{3, kMaxHoleEdges}});
    line.add("--crease-angle",
             "Degrees from which on an edge is sharp, 0..180; default by shape: scans 75, constructed 44, STL 0",
             &options.crease_angle, {.check = angle});
    line.add("--alpha-cutoff",
             "Texels with a smaller opacity are no surface, 0..1; none: all are; default: as materials say",
             command_line::stored(alpha_cutoff, options.alpha_cutoff),
             {.type = "N|none", .check = command_line::readable(alpha_cutoff)});
    line.add("--flip-green", "The green of normal maps points downwards, as DirectX has it", &options.flip_green);
}

void add_grid_options(CommandLine &line, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    line.topic = "Grid";
    line.add("--depth", "Depth: 2^N voxels per edge of the grid, 5..16", &options.grid.depth,
             {.check = command_line::Integers{kMinBuildDepth, kMaxDepth}});
    line.add("--voxel-size", "Voxel edge in model units; the grid snaps to multiples of it", &options.grid.voxel_size,
             {.check = positive, .excludes = {"--depth"}});
    line.add("--max-points", "Depth with at most so many points, estimated from the area", &options.grid.max_points,
             {.check = positive, .excludes = {"--depth", "--voxel-size"}});
    line.add("--grid-like", "Very same grid, unit and up axis as this .pbvg file", &arguments.grid_like,
             {.type = "FILE", .excludes = {"--depth", "--voxel-size", "--max-points", "--unit", "--up"}});
}

void add_output_options(CommandLine &line, Arguments &arguments) {
    BuildOptions &options = arguments.build;
    line.topic = "Output";
    line.add("-z,--compression-level", "zstd level 1..19", &options.compression_level,
             {.check = command_line::Integers{1, 19}, .shows_default = true});
    add_choice<Storage>(line, "--store", options.storage, {{"packed", Storage::packed}, {"mapped", Storage::mapped}},
                        "Small, or raw to be drawn where it lies; default packed");
    add_choice<ColourFormat>(line, "--colour,--color", options.colour,
                             {{"565", ColourFormat::rgb565}, {"888", ColourFormat::rgb888}},
                             "Bits of a colour; default 888");
    Credits &credits = options.credits;
    line.add("--name", "Name of the model, kept in the file", &credits.name);
    line.add("--licence,--license", "Licence, kept in the file", &credits.licence);
    line.add("--credit", "Whom to credit, kept in the file", &credits.credit);
}

void add_recipe(CommandLine &line) {
    line.topic = "Build systems";
    line.add("--recipe", "Options from a TOML file; the command line wins", command_line::SettingsFile{read_recipe},
             {.type = "FILE"});
}

void add_build_system_options(CommandLine &line, Arguments &arguments) {
    line.add("--allow-outside", "Let the recipe name outputs, JSON and log outside its folder",
             &arguments.allow_outside, {.is_setting = false, .needs = "--recipe"});
    line.add("--if-changed",
             "Build only if the output is not what the input and options would give, and leave it and its "
             "time alone if it turns out the same. An input that did not change is read, not built. Keeps "
             "--source-hash",
             &arguments.if_changed);
    line.add("--source-hash", "Keep hashes (XXH3) of the input and of the options in the file's metadata",
             &arguments.source_hash);
    line.add("--write-dependencies", "Write what was read, for Make and Ninja, to the output's name with .d",
             &arguments.depfile);
    line.add("--dependency-file", "The same, to FILE", &arguments.depfile_name, {.type = "FILE"});
    line.add("--action-key",
             "Print a hash of all that decides the output's bytes (input, options, versions), and do nothing else",
             &arguments.action_key, {.is_setting = false});
    line.add("--progress",
             "Print progress to stdout for a program that shows it: lines of a step's percentage and name",
             &arguments.progress);
    line.add("--dependency-target", "The output's name in it, as the build system knows it", &arguments.depfile_target,
             {.type = "NAME"});
}

void add_batch_options(CommandLine &line, Arguments &arguments) {
    line.topic = "Many scans";
    line.add("--batch", "Build each scan of a folder, or of a list with a path a line, to a file of its own",
             &arguments.batch, {.type = "LIST|DIR", .is_setting = false, .excludes = {"--action-key"}});
    line.add("--output-dir", "Folder for the models of --batch", &arguments.output_folder,
             {.type = "DIR", .is_setting = false, .needs = "--batch"});
    line.add("--batch-root", "Models of a list lie as their scans do in DIR", &arguments.batch_root,
             {.type = "DIR", .is_setting = false, .needs = "--batch"});
    line.add("--keep-extension", "Name models lion.ply.pbvg, not lion.pbvg", &arguments.keep_extension,
             {.is_setting = false, .needs = "--batch"});
    line.add("--keep-going", "Build the other scans of --batch after a failure", &arguments.keep_going,
             {.is_setting = false, .needs = "--batch"});
    line.add("--shard", "One of N machines (I of 0..N-1): its share of --batch by names, or part I of one model",
             command_line::stored(parse_shard, arguments.shard),
             {.type = "I/N",
              .check = command_line::readable(parse_shard),
              .is_setting = false,
              .excludes = {"--action-key"}});
    line.add("--merge", "Make the model from its N parts, which --shard 0/N ... built with the same inputs and options",
             &arguments.merged,
             {.check = command_line::Integers{2, kMaxTasks},
              .is_setting = false,
              .excludes = {"--shard", "--batch", "--action-key"}});
    line.add("--plan", "Write what --batch, or --shards for one model, would do for Ninja or Slurm, and build nothing",
             &arguments.plan,
             {.type = "FILE.ninja|FILE.slurm",
              .check =
                  [](const std::string &name) {
                      const std::string extension = lower_extension(name);
                      return extension == ".ninja" || extension == ".slurm"
                                 ? std::string()
                                 : "'" + name + "' is no plan; name it FILE.ninja or FILE.slurm";
                  },
              .is_setting = false,
              .excludes = {"--action-key"}});
    line.add("--timeout", "Seconds that the build of one scan of --batch may take; it is then ended, and has failed",
             &arguments.timeout,
             {.type = "SECONDS",
              .check = command_line::Numbers{0.001, 1e9},
              .is_setting = false,
              .excludes = {"--plan"},
              .needs = "--batch"});
    line.add("--shards", "Parts of the model that --plan divides among machines", &arguments.shards,
             {.check = command_line::Integers{2, kMaxTasks},
              .is_setting = false,
              .excludes = {"--batch", "--shard", "--merge"},
              .needs = "--plan"});
    line.add("--cache",
             "Folder of models by the hashes of input and options: one that is there is copied, not built; default "
             "$PBM_CACHE_DIR",
             &arguments.cache, {.type = "DIR", .is_setting = false});
    line.add("--cache-size", "The least recently used models are removed beyond it; default 20G",
             command_line::stored(command_line::parse_bytes, arguments.cache_size),
             {.type = "BYTES", .check = command_line::readable(command_line::parse_bytes), .is_setting = false});
}

void add_page_options(CommandLine &line, Arguments &arguments) {
    line.topic = "Output";
    line.add(
        "--page",
        "Also write a folder for a web server, with a page that shows the model; without -o the model lies there alone",
        &arguments.page,
        {.type = "DIR", .is_setting = false, .excludes = {"--action-key", "--batch", "--plan", "--shard"}});
    line.add("--page-view", "Options of pbm-render for the view of the page, in one word", &arguments.page_view,
             {.type = "OPTIONS", .is_setting = false, .needs = "--page"});
}

void add_memory_options(CommandLine &line, Arguments &arguments) {
    line.topic = "General";
    line.add(
        "--max-memory",
        "Resident memory, like 4G; default a quarter of the machine's: what is larger lies in temporary files. Of "
        "--batch: of all builds together, by estimates, fewer of which run at a time; default half of the machine's",
        command_line::stored(command_line::parse_bytes, arguments.max_memory),
        {.type = "BYTES", .check = command_line::readable(command_line::parse_bytes), .is_setting = false});
    line.add("--temp-dir", "Folder for the temporary files of --max-memory; default $TMPDIR, else /var/tmp",
             &arguments.temp_folder, {.type = "DIR", .is_setting = false});
}

void add_general_options(CommandLine &line, Arguments &arguments) {
    line.topic = "General";
    command_line::add_threads(line, arguments.build.threads);
    command_line::add_json(line, arguments.json, "Statistics");
    command_line::add_quiet(line, arguments.verbosity);
    line.add("--warnings", "Say nothing but errors and what was dropped",
             [&arguments] { arguments.verbosity = command_line::Verbosity::warnings; }, {.excludes = {"--quiet"}});
    line.add("--allow", "Leave lines of these names out of report, warnings and log", &arguments.allow,
             {.type = "NAME,..", .check = unknown_warning, .separator = ',', .proposals = [] {
                  return warning_names(false);
              }});
    line.add("--list-warnings", "Names for --deny and --allow; --list-warnings=markdown", &arguments.list_warnings,
             {.alone = "text", .is_setting = false});
    command_line::add_verbose(line, arguments.verbosity, "Name every step");
    line.add_version(PBM_VERSION);
}

// The options that decide what is in the model. A program adds its input and its output.
void add_model_options(CommandLine &line, Arguments &arguments, SceneArguments &scene) {
    add_input_options(line, arguments);
    add_field_options(line, arguments);
    add_mesh_options(line, arguments);
    add_grid_options(line, arguments);
    add_scene_options(line, scene);
}

// Takes what needs several of these options; `line` has been parsed.
Status take_model_values(const CommandLine &line, const SceneArguments &scene, Arguments &arguments) {
    Result<SceneRequest> request = scene_request(line, scene);
    if (!request)
        return request.error();
    arguments.build.scene = std::move(*request);
    if (arguments.fields.size() > kMaxFields)
        return usage_error("--field is given " + std::to_string(arguments.fields.size()) +
                           " times; a model keeps at most 8 fields");
    for (const std::string &text : arguments.fields) {
        FieldRequest field = *parse_field(text);
        for (const FieldRequest &other : arguments.build.fields)
            if (other.name == field.name)
                return usage_error("--field " + field.name + " is given twice");
        arguments.build.fields.push_back(std::move(field));
    }
    for (const std::string &text : arguments.viewpoints)
        arguments.build.viewpoints.push_back(*three_numbers(text));
    arguments.build.denied = warnings_named(arguments.deny);
    return {};
}

} // namespace

std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments) {
    CommandLine line{
        "pbm-build",
        "Turns a scan into a binary voxel grid (.pbvg).\n"
        "Reads " +
            names_of_formats() +
            ".\n"
            "Says of every attribute of the scan whether it was kept, converted or dropped.\n"
            "In a recipe every long option is a key without its dashes (depth = 9), INPUT is input, lights "
            "and materials may be tables ([[light]]), and names of files are relative to the recipe's folder. "
            "The command line wins over the recipe."};
    line.topic = "Input";
    line.add("INPUT", "Scans, merged if several; - for standard input", &arguments.inputs);
    SceneArguments scene;
    add_model_options(line, arguments, scene);
    line.topic = "Output";
    line.add("-o,--output", "File to write, - for stdout; default: INPUT.pbvg", &arguments.output, {.type = "FILE"});
    add_output_options(line, arguments);
    add_recipe(line);
    add_build_system_options(line, arguments);
    add_batch_options(line, arguments);
    add_page_options(line, arguments);
    add_general_options(line, arguments);
    add_memory_options(line, arguments);
    const command_line::Manual manual{
        .most_used = {"--output", "--depth", "--unit", "--up", "--recipe", "--help"},
        .examples = {{"pbm-build scan.ply -o scan.pbvg", "A scan at the depth that fits its points."},
                     {"pbm-build left.ply right.ply --depth 10 --unit mm --up z --strict -o scan.pbvg",
                      "Two scans as one model of at most 1,024 voxels per edge; an error if anything of them would be "
                      "dropped."},
                     {"pbm-build scan.ply --lights studio --shadows --ground wood --panorama default -o scan.pbvg",
                      "With shadows on a wooden floor, under a sky."},
                     {"pbm-build scan.ply --page site", "A page that shows the scan; python3 -m http.server -d site."},
                     {"pbm-build --recipe scan.toml --if-changed -MF scan.d -o scan.pbvg",
                      "As build systems call it."}},
        .logs_steps = true};
    std::vector<std::string> words = with_optional_values({argv, argv + argc});
    std::vector<char *> pointers;
    pointers.reserve(words.size());
    for (std::string &word : words)
        pointers.push_back(word.data());
    if (const auto done =
            command_line::parse(line, static_cast<int>(pointers.size()), pointers.data(), kSwitches, manual))
        return done;
    if (const Status taken = take_model_values(line, scene, arguments); !taken)
        return command_line::fail_usage(program, taken.error().message);
    if (const auto done = take_warnings(program, arguments))
        return done;
    const bool is_batch = !arguments.batch.empty();
    if (const auto refused = is_batch ? take_batch(line, arguments) : check_inputs(program, arguments))
        return refused;
    arguments.depfile = arguments.depfile || !arguments.depfile_name.empty();
    describe_request(line, arguments);
    if (is_batch)
        return std::nullopt;
    collect_forwarded(line, arguments);
    if (const auto refused = name_output(line, arguments))
        return refused;
    return check_parts(line, arguments);
}

Result<BuildOptions> read_options(std::span<const OptionValue> given) {
    Arguments arguments;
    SceneArguments scene;
    CommandLine line{"pbm-build", "Options of a build"};
    add_model_options(line, arguments, scene);
    add_output_options(line, arguments);
    add_recipe(line);
    command_line::add_threads(line, arguments.build.threads);
    Result<std::vector<std::string>> words = command_line::words_of(line, given);
    if (!words)
        return words.error();
    if (Status parsed = command_line::parse_words(line, with_optional_values(*words)); !parsed)
        return parsed.error();
    if (Status taken = take_model_values(line, scene, arguments); !taken)
        return taken.error();
    if (!arguments.grid_like.empty()) {
        Result<Grid> grid = read_grid(arguments.grid_like);
        if (!grid)
            return Error{grid.error().code, grid.error().offset, arguments.grid_like + ": " + grid.error().message};
        arguments.build.grid.like = *grid;
    }
    return std::move(arguments.build);
}

} // namespace pbm::build
