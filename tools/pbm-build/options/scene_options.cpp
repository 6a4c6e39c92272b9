#include "scene_options.h"

#include "pbm_bake/shadow_baker.h"
#include "pbm_build/scene/material_request.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <array>
#include <filesystem>

namespace pbm::build {
namespace {

using command_line::CommandLine;

constexpr const char *kLights = "Lights", *kMaterials = "Materials", *kSurroundings = "Surroundings";
constexpr std::string_view kDefaultPanorama = "default";

template <class To, class From> void assign(To &to, From from) { to = static_cast<To>(from); }
template <class To, class From> void assign(std::optional<To> &to, From from) { to = static_cast<To>(from); }

auto number_within(const command_line::Numbers &range) {
    return [least = range.least, most = range.most](const std::string &text) -> Result<double> {
        Result<double> number = read_number(text);
        if (number && !(*number >= least && *number <= most))
            return usage_error(in_quotes(text) + formatted(" is not within %g..%g", least, most));
        return number;
    };
}

template <class T>
void add_number(CommandLine &line, const char *name, T &value, const command_line::Numbers &range, const char *help,
                const char *needs = "") {
    const auto read = number_within(range);
    line.add(name, help,
             [&value, read](const std::string &text) -> Status { return assign(value, *read(text)), Status(); },
             {.type = "N", .check = command_line::readable(read), .needs = needs});
}

// Adds an option for a power of two.
template <class T>
void add_power(CommandLine &line, const char *name, T &value, const command_line::Integers &range,
               const std::string &help, const char *needs) {
    command_line::Words words;
    for (std::int64_t power = range.least; power <= range.most; power *= 2)
        words.push_back(std::to_string(power));
    line.add(name, help,
             [&value](const std::string &word) -> Status { return assign(value, std::stoi(word)), Status(); },
             {.check = std::move(words), .needs = needs});
}

void add_light_options(CommandLine &line, SceneArguments &arguments) {
    line.topic = kLights;
    command_line::Words sets;
    for (const std::string_view name : light_set_names())
        sets.emplace_back(name);
    line.add("--lights",
             "A set of lights that fits any model and stays with it; default: viewers light it from beside the eye",
             &arguments.light_set, {.check = std::move(sets)});
    line.add("--light",
             "One more light, up to 8: directional, point or spot, then key=value between commas. "
             "from=RIGHT,UP,FRONT: its place in radii of the model; or direction=X,Y,Z, position=, target= in "
             "the model; intensity=N or R,G,B; colour=#rrggbb; exponent=N; shadows=on|off; size=N: soft shadows",
             &arguments.lights, {.type = "LIGHT", .check = command_line::readable(read_light)});
    line.add("--shadows", "Bake the shadows of lights on object and ground plane", &arguments.shadows);
    ShadowRequest &options = arguments.shadow_options;
    add_power(line, "--shadow-bits", options.bits, {1, 8}, "Bits of a point's lit fraction; default 1, soft shadows 4",
              "--shadows");
    line.add("--shadow-maps", "Shadow maps per light; default: rays at faces, 4 maps of points, 24 if soft",
             &options.maps, {.check = command_line::Integers{1, kMaxShadowMaps}, .needs = "--shadows"});
}

void add_material_options(CommandLine &line, SceneArguments &arguments) {
    line.topic = kMaterials;
    line.add("--material",
             "Material of the object, or several: of its 1st, 2nd... material. " + joined(material_names()) +
                 "; then ka=, kd=, ks=, power=, colour=#rrggbb, environment=, tint=: \"gold,ks=0.5\"",
             &arguments.materials, {.type = "MATERIAL", .check = command_line::readable(read_material)});
    line.add("--legacy-material", "Default material of the dissertation: ambient grey", &arguments.legacy_material);
    line.add("--ignore-point-colours,--ignore-point-colors", "Leave colours and materials of the scan out",
             &arguments.request.ignore_point_colours);
    add_number(line, "--environment", arguments.request.environment, {0, 1},
               "Reflection of the panorama by all materials");
    line.add("--environment-map", "A panorama to reflect; by half if no material asks", &arguments.environment_map);
    line.add("--texture", "Solid texture, beside the point colours; alone: marble", &arguments.texture,
             {.check = command_line::Words{"marble", "wood"}});
    TextureOptions &options = arguments.texture_options;
    add_number(line, "--texture-scale", options.scale, {kMinTextureScale, kMaxTextureScale},
               "Veins or rings across the grid", "--texture");
    add_number(line, "--texture-turbulence", options.turbulence, {0, kMaxTurbulence},
               "0: straight veins, round rings; default 1", "--texture");
    line.add("--texture-seed", "Another block of stone or wood; default 0", &options.seed, {.needs = "--texture"});
    line.add("--texture-colours,--texture-colors", "A name, or like 0:#30251c,1:#d9b98c", &options.colours,
             {.type = "COLOURS", .needs = "--texture"});
}

void add_surroundings_options(CommandLine &line, SceneArguments &arguments) {
    line.topic = kSurroundings;
    line.add("--ground", "A square under the object; alone: plain", &arguments.ground,
             {.check = command_line::Words{"plain", "marble", "wood"}});
    GroundRequest &ground = arguments.ground_options;
    add_number(line, "--ground-size", ground.size, {0.1, 100}, "Half its edge, in radii of the model; default 3.5",
               "--ground");
    add_number(line, "--ground-height", ground.height, {-1e30, 1e30}, "Along the up axis; default: the lowest point",
               "--ground");
    line.add("--ground-material", "As --material; default a light grey", &arguments.ground_material,
             {.type = "MATERIAL", .check = command_line::readable(read_material), .needs = "--ground"});
    line.add("--ground-colours,--ground-colors", "As --texture-colours", &ground.colours,
             {.type = "COLOURS", .needs = "--ground"});
    add_number(line, "--ground-scale", ground.scale, {kMinTextureScale, kMaxTextureScale}, "As --texture-scale",
               "--ground");
    add_power(line, "--ground-resolution", ground.texels, {64, kMaxGroundRaster},
              "Texels per edge of its shadows and its texture; default " + std::to_string(kDefaultGroundTexels),
              "--ground");
    line.add("--panorama", "Surroundings: an equirectangular image, or the default one", &arguments.panorama,
             {.type = "FILE|default"});
    PanoramaOptions &panorama = arguments.panorama_options;
    add_number(line, "--panorama-exposure", panorama.exposure, {1e-6, 1e6}, "Brightness of HDR images; default 1",
               "--panorama");
    add_power(line, "--panorama-width", panorama.width, {256, kMaxPanoramaWidth},
              "Default: nearest to the image's, at most " + std::to_string(kMaxDefaultWidth), "--panorama");
}

// Options of the scene as the user gave them, for metadata, without names of files.
std::vector<GivenOption> given_options(const CommandLine &line) {
    std::vector<GivenOption> given;
    for (const command_line::GivenValue &option : line.given) {
        if (option.topic != kLights && option.topic != kMaterials && option.topic != kSurroundings)
            continue;
        std::string name = option.name.substr(2); // without dashes
        std::replace(name.begin(), name.end(), '-', '_');
        given.push_back({name, option.is_file ? "image" : option.value});
    }
    return given;
}

Result<GroundRequest> ground_request(const SceneArguments &arguments) {
    GroundRequest ground = arguments.ground_options;
    ground.texture = texture_kind(arguments.ground);
    if (!ground.texture && (ground.scale || !ground.colours.empty()))
        return usage_error("--ground-scale and --ground-colours need --ground marble or wood");
    if (!arguments.ground_material.empty())
        ground.material = *read_material(arguments.ground_material);
    if (ground.texture)
        if (auto made = make_texture({.kind = *ground.texture, .colours = ground.colours, .scale = ground.scale});
            !made)
            return usage_error("--ground-colours: " + made.error().message);
    return ground;
}

bool is_image_name(const std::string &word) {
    const std::string extension = lower_case(std::filesystem::path(word).extension().string());
    return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".hdr";
}

bool is_texture(const std::string &word) { return texture_kind(word).has_value(); }
bool is_ground(const std::string &word) { return word == "plain" || is_texture(word); }
bool is_panorama(const std::string &word) { return word == kDefaultPanorama || is_image_name(word); }

// An option whose value is the next word if takes(word), else `alone`.
struct OptionalValue {
    std::string_view word, option, alone;
    bool (*takes)(const std::string &word);
};
constexpr std::array<OptionalValue, 4> kOptionalValues{{{"--texture", "--texture", "marble", is_texture},
                                                        {"-TEXTURE", "--texture", "marble", is_texture},
                                                        {"--ground", "--ground", "plain", is_ground},
                                                        {"-BACKGROUND", "--panorama", "default", is_panorama}}};

} // namespace

std::vector<std::string> with_optional_values(const std::vector<std::string> &words) {
    const auto names = std::find(words.begin(), words.end(), "--"); // names of files follow
    const auto has = [&](std::string_view begin) {
        return std::any_of(words.begin(), names, [&](const std::string &word) { return word.starts_with(begin); });
    };
    std::vector<std::string> result;
    for (auto word = words.begin(); word != words.end(); ++word) {
        const auto *const value = std::find_if(kOptionalValues.begin(), kOptionalValues.end(),
                                               [&](const OptionalValue &known) { return known.word == *word; });
        if (word >= names || value == kOptionalValues.end()) {
            result.push_back(*word);
            continue;
        }
        if (*word == "-BACKGROUND" && !has("--ground"))
            result.emplace_back(has("-TEXTURE") ? "--ground=wood" : "--ground=plain");
        const bool takes = word + 1 < names && value->takes(*(word + 1));
        result.push_back(std::string(value->option) + "=" + (takes ? *(word + 1) : std::string(value->alone)));
        word += takes ? 1 : 0;
    }
    return result;
}

void add_scene_options(CommandLine &line, SceneArguments &arguments) {
    add_light_options(line, arguments);
    add_material_options(line, arguments);
    add_surroundings_options(line, arguments);
}

Result<SceneRequest> scene_request(const CommandLine &line, const SceneArguments &arguments) {
    SceneRequest request = arguments.request;
    if (!arguments.light_set.empty())
        request.lights = light_set(arguments.light_set);
    for (const std::string &text : arguments.lights)
        request.lights.push_back(*read_light(text));
    if (request.lights.size() > kMaxLights)
        return usage_error(std::to_string(request.lights.size()) + " lights, a .pbvg file holds " +
                           std::to_string(kMaxLights));
    for (const std::string &text : arguments.materials)
        request.materials.push_back(*read_material(text));
    if (request.materials.size() > kMaxMaterials)
        return usage_error(std::to_string(request.materials.size()) + " materials, a .pbvg file holds " +
                           std::to_string(kMaxMaterials));
    if (arguments.legacy_material)
        request.default_material = *read_material("legacy");
    request.reflects = arguments.environment_map;
    if (!arguments.texture.empty()) {
        request.texture = arguments.texture_options;
        request.texture->kind = *texture_kind(arguments.texture);
        if (auto made = make_texture(*request.texture); !made)
            return usage_error("--texture-colours: " + made.error().message);
    }
    if (arguments.shadows)
        request.shadows = arguments.shadow_options;
    if (!arguments.ground.empty()) {
        Result<GroundRequest> ground = ground_request(arguments);
        if (!ground)
            return ground.error();
        request.ground = std::move(*ground);
    }
    if (!arguments.panorama.empty() || request.reflects)
        request.panorama =
            PanoramaRequest{.file = arguments.panorama == kDefaultPanorama ? std::string() : arguments.panorama,
                            .options = arguments.panorama_options};
    request.given = given_options(line);
    return request;
}

} // namespace pbm::build
