#include "scene_options.h"

#include "command_line/parse.h"
#include "pbm_bake/shadow_baker.h"
#include "pbm_build/scene/material_request.h"
#include "pbm_build/texture/colour_map.h"

#include <algorithm>
#include <array>
#include <filesystem>

namespace pbm::build {
namespace {

constexpr const char *kLights = "Lights", *kMaterials = "Materials", *kSurroundings = "Surroundings";
constexpr std::string_view kDefaultPanorama = "default";

constexpr std::array<command_line::OldSwitch, 5> kSwitches{{{"-SHADOW", "--shadows"},
                                                            {"-TEXTURE", "--texture"},
                                                            {"-IGNORE_POINT_COLOURS", "--ignore-point-colours"},
                                                            {"-ENVIRONMENT_MAP", "--environment-map"},
                                                            {"-BACKGROUND", "--panorama"}}};

Error usage(std::string message) { return {ErrorCode::usage, 0, std::move(message)}; }

template <class To, class From> void assign(To &to, From from) { to = static_cast<To>(from); }
template <class To, class From> void assign(std::optional<To> &to, From from) { to = static_cast<To>(from); }

// A check for CLI11 of a text that `read` understands.
template <class Read> auto readable(Read read) {
    return [read](const std::string &text) {
        const auto value = read(text);
        return value ? std::string() : value.error().message;
    };
}

auto number_within(double least, double most) {
    return readable([least, most](const std::string &text) -> Result<double> {
        Result<double> number = read_number(text);
        if (number && !(*number >= least && *number <= most)) {
            std::array<char, 64> range{};
            std::snprintf(range.data(), range.size(), " is not within %g..%g", least, most);
            return usage(in_quotes(text) + range.data());
        }
        return number;
    });
}

std::string listed(std::span<const std::string_view> names) {
    std::string text;
    for (const std::string_view name : names)
        (text += text.empty() ? "" : ", ") += name;
    return text;
}

CLI::Option *add_word(CLI::App &app, const std::string &name, std::optional<std::string> &value,
                      const std::vector<std::string> &words, const std::string &help) {
    return app
        .add_option_function<std::string>(
            name, [&value](const std::string &word) { value = word; }, help)
        ->check(CLI::IsMember(words));
}

template <class T>
CLI::Option *add_number(CLI::App &app, const std::string &name, T &value, double least, double most,
                        const std::string &help) {
    return app
        .add_option_function<std::string>(
            name, [&value](const std::string &text) { assign(value, *read_number(text)); }, help)
        ->check(number_within(least, most))
        ->type_name("N");
}

// Powers of two.
template <class T>
CLI::Option *add_power(CLI::App &app, const std::string &name, T &value, int least, int most, const std::string &help) {
    std::vector<std::string> words;
    for (int power = least; power <= most; power *= 2)
        words.push_back(std::to_string(power));
    return app
        .add_option_function<std::string>(
            name, [&value](const std::string &word) { assign(value, std::stoi(word)); }, help)
        ->check(CLI::IsMember(words));
}

void add_light_options(CLI::App &app, SceneArguments &arguments) {
    app.option_defaults()->group(kLights);
    std::vector<std::string> sets;
    for (const std::string_view name : light_set_names())
        sets.emplace_back(name);
    app.add_option("--lights", arguments.light_set, "A set of lights that fits any model; default: viewers choose")
        ->check(CLI::IsMember(sets));
    app.add_option("--light", arguments.lights,
                   "One more light, up to 8: directional, point or spot, then key=value between commas. "
                   "from=RIGHT,UP,FRONT: its place in radii of the model; or direction=X,Y,Z, position=, target= in "
                   "the model; intensity=N or R,G,B; colour=#rrggbb; exponent=N; shadows=on|off; size=N: soft shadows")
        ->check(readable(read_light))
        ->type_name("LIGHT")
        ->allow_extra_args(false);
    auto *shadows =
        app.add_flag("--shadows", arguments.shadows, "Bake the shadows of lights on object and ground plane");
    add_power(app, "--shadow-bits", arguments.shadow_options.bits, 1, 8,
              "Bits of a point's lit fraction; default 1, soft shadows 4")
        ->needs(shadows);
    app.add_option("--shadow-maps", arguments.shadow_options.maps,
                   "Shadow maps per light; default: rays at faces, 4 maps of points, 24 if soft")
        ->check(CLI::Range(1, kMaxShadowMaps))
        ->needs(shadows);
}

void add_material_options(CLI::App &app, SceneArguments &arguments) {
    app.option_defaults()->group(kMaterials);
    app.add_option("--material", arguments.materials,
                   "Material of the object, or several: of its 1st, 2nd... material. " + listed(material_names()) +
                       "; then ka=, kd=, ks=, power=, colour=#rrggbb, environment=: \"gold,ks=0.5\"")
        ->check(readable(read_material))
        ->type_name("MATERIAL")
        ->allow_extra_args(false);
    app.add_flag("--legacy-material", arguments.legacy_material, "Default material of the dissertation: ambient grey");
    app.add_flag("--ignore-point-colours,--ignore-point-colors", arguments.request.ignore_point_colours,
                 "Leave colours and materials of the scan out");
    add_number(app, "--environment", arguments.request.environment, 0, 1,
               "Reflection of the panorama by all materials");
    app.add_flag("--environment-map", arguments.environment_map, "A panorama to reflect; by half if no material asks");
    auto *texture = add_word(app, "--texture", arguments.texture, {"marble", "wood"},
                             "Solid texture, beside the point colours; alone: marble");
    add_number(app, "--texture-scale", arguments.texture_options.scale, kLeastTextureScale, kMostTextureScale,
               "Veins or rings across the grid")
        ->needs(texture);
    add_number(app, "--texture-turbulence", arguments.texture_options.turbulence, 0, kMostTurbulence,
               "0: straight veins, round rings; default 1")
        ->needs(texture);
    app.add_option("--texture-seed", arguments.texture_options.seed, "Another block of stone or wood; default 0")
        ->needs(texture);
    app.add_option("--texture-colours,--texture-colors", arguments.texture_options.colours,
                   "A name, or like 0:#30251c,1:#d9b98c")
        ->type_name("COLOURS")
        ->needs(texture);
}

void add_surroundings_options(CLI::App &app, SceneArguments &arguments) {
    app.option_defaults()->group(kSurroundings);
    auto *ground = add_word(app, "--ground", arguments.ground, {"plain", "marble", "wood"},
                            "A square under the object; alone: plain");
    GroundRequest &options = arguments.ground_options;
    add_number(app, "--ground-size", options.size, 0.1, 100, "Half its edge, in radii of the model; default 3.5")
        ->needs(ground);
    add_number(app, "--ground-height", options.height, -1e30, 1e30, "Along the up axis; default: the lowest point")
        ->needs(ground);
    app.add_option("--ground-material", arguments.ground_material, "As --material; default a light grey")
        ->check(readable(read_material))
        ->type_name("MATERIAL")
        ->needs(ground);
    app.add_option("--ground-colours,--ground-colors", options.colours, "As --texture-colours")
        ->type_name("COLOURS")
        ->needs(ground);
    add_number(app, "--ground-scale", options.scale, kLeastTextureScale, kMostTextureScale, "As --texture-scale")
        ->needs(ground);
    add_power(app, "--ground-resolution", options.texels, 64, kMaxGroundRaster,
              "Texels per edge of its shadows and its texture; default " + std::to_string(kDefaultGroundTexels))
        ->needs(ground);
    auto *panorama = app.add_option("--panorama", arguments.panorama,
                                    "Surroundings: an equirectangular PNG, JPEG or HDR image, or the default one")
                         ->type_name("FILE|default");
    add_number(app, "--panorama-exposure", arguments.panorama_options.exposure, 1e-6, 1e6,
               "Brightness of HDR images; default 1")
        ->needs(panorama);
    add_power(app, "--panorama-width", arguments.panorama_options.width, 256, kMaxPanoramaWidth,
              "Default: nearest to the image's, at most " + std::to_string(kMostDefaultWidth))
        ->needs(panorama);
}

// Options of the scene as they were given, for metadata: names of files stay out.
std::vector<GivenOption> given_options(const CLI::App &app) {
    std::vector<GivenOption> given;
    for (const CLI::Option *option : app.get_options()) {
        const std::string &group = option->get_group();
        if (group != kLights && group != kMaterials && group != kSurroundings)
            continue;
        std::string name = option->get_lnames().front();
        std::replace(name.begin(), name.end(), '-', '_');
        for (const std::string &value : option->results())
            given.push_back({name, command_line::names_file(*option, value) ? "image" : value});
    }
    return given;
}

Result<GroundRequest> ground_request(const SceneArguments &arguments) {
    GroundRequest ground = arguments.ground_options;
    ground.texture = texture_kind(*arguments.ground);
    if (!ground.texture && (ground.scale || !ground.colours.empty()))
        return usage("--ground-scale and --ground-colours need --ground marble or wood");
    if (!arguments.ground_material.empty())
        ground.material = *read_material(arguments.ground_material);
    if (ground.texture)
        if (auto made = make_texture({.kind = *ground.texture, .colours = ground.colours, .scale = ground.scale});
            !made)
            return usage("--ground-colours: " + made.error().message);
    return ground;
}

bool is_image_name(const std::string &word) {
    std::string extension = std::filesystem::path(word).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".hdr";
}

bool is_texture(const std::string &word) { return texture_kind(word).has_value(); }
bool is_ground(const std::string &word) { return word == "plain" || is_texture(word); }
bool is_panorama(const std::string &word) { return word == kDefaultPanorama || is_image_name(word); }

// A word that takes the next one if that is meant for it.
struct OptionalValue {
    std::string_view word, option, alone;
    bool (*takes)(const std::string &word);
};
constexpr std::array<OptionalValue, 4> kOptionalValues{{{"--texture", "--texture", "marble", is_texture},
                                                        {"-TEXTURE", "--texture", "marble", is_texture},
                                                        {"--ground", "--ground", "plain", is_ground},
                                                        {"-BACKGROUND", "--panorama", "default", is_panorama}}};

} // namespace

std::span<const command_line::OldSwitch> scene_switches() { return kSwitches; }

std::vector<std::string> with_optional_values(int argc, char **argv) {
    const std::vector<std::string> words(argv, argv + argc);
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

void add_scene_options(CLI::App &app, SceneArguments &arguments) {
    add_light_options(app, arguments);
    add_material_options(app, arguments);
    add_surroundings_options(app, arguments);
}

Result<SceneRequest> scene_request(const CLI::App &app, const SceneArguments &arguments) {
    SceneRequest request = arguments.request;
    if (!arguments.light_set.empty())
        request.lights = light_set(arguments.light_set);
    for (const std::string &text : arguments.lights)
        request.lights.push_back(*read_light(text));
    if (request.lights.size() > kMaxLights)
        return usage(std::to_string(request.lights.size()) + " lights, a .pbvg file holds " +
                     std::to_string(kMaxLights));
    for (const std::string &text : arguments.materials)
        request.materials.push_back(*read_material(text));
    if (request.materials.size() > kMaxMaterials)
        return usage(std::to_string(request.materials.size()) + " materials, a .pbvg file holds " +
                     std::to_string(kMaxMaterials));
    if (arguments.legacy_material)
        request.default_material = *read_material("legacy");
    request.reflects = arguments.environment_map;
    if (arguments.texture) {
        request.texture = arguments.texture_options;
        request.texture->kind = *texture_kind(*arguments.texture);
        if (auto made = make_texture(*request.texture); !made)
            return usage("--texture-colours: " + made.error().message);
    }
    if (arguments.shadows)
        request.shadows = arguments.shadow_options;
    if (arguments.ground) {
        Result<GroundRequest> ground = ground_request(arguments);
        if (!ground)
            return ground.error();
        request.ground = std::move(*ground);
    }
    if (!arguments.panorama.empty() || request.reflects)
        request.panorama =
            PanoramaRequest{.file = arguments.panorama == kDefaultPanorama ? std::string() : arguments.panorama,
                            .options = arguments.panorama_options};
    request.given = given_options(app);
    return request;
}

} // namespace pbm::build
