#include "viewer/pbm-view/light/scene_text.h"

#include "pbm_format/model/material_presets.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

namespace pbm {
namespace {

// Shortest text that reads back as the same number.
template <class Number> std::string text_of(Number number) {
    std::array<char, 40> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
    return {text.data(), end};
}

template <class Numbers> std::string list_of(const Numbers &numbers) {
    std::string text;
    for (const auto number : numbers)
        (text += text.empty() ? "" : ",") += text_of(number);
    return text;
}

std::string hex_of(Rgb8 colour) {
    std::array<char, 8> text{};
    std::snprintf(text.data(), text.size(), "#%02x%02x%02x", colour[0], colour[1], colour[2]);
    return text.data();
}

// A field of an option; a recipe writes lists in brackets and words in quotes.
struct PlacedField {
    enum class Kind { number, list, word, flag };
    std::string key, value;
    Kind kind = Kind::number;
};

constexpr std::array<const char *, 3> kKinds{"directional", "point", "spot"};

std::vector<PlacedField> fields_of(const Light &light, const Grid &grid, std::optional<bool> casts) {
    std::vector<PlacedField> fields;
    if (light.kind != LightKind::directional) {
        std::array<double, 3> position = grid.origin;
        for (std::size_t axis = 0; axis < 3; ++axis)
            position[axis] += static_cast<double>(light.position[axis]);
        fields.push_back({"position", list_of(position), PlacedField::Kind::list});
    }
    if (light.kind != LightKind::point)
        fields.push_back({"direction", list_of(light.direction), PlacedField::Kind::list});
    if (light.kind == LightKind::spot)
        fields.push_back({"exponent", text_of(light.exponent)});
    fields.push_back({"intensity", list_of(light.intensity), PlacedField::Kind::list});
    if (casts)
        fields.push_back({"shadows", *casts ? "on" : "off", PlacedField::Kind::flag});
    return fields;
}

// The preset, or "default" and what replaces its values.
std::pair<std::string_view, std::vector<PlacedField>> fields_of(const Material &material) {
    for (const MaterialPreset &preset : kMaterialPresets)
        if (preset.material == material)
            return {preset.name, {}};
    std::vector<PlacedField> fields{{"ka", text_of(material.ka)},
                                    {"kd", text_of(material.kd)},
                                    {"ks", text_of(material.ks)},
                                    {"power", text_of(material.power)},
                                    {"environment", text_of(material.environment)},
                                    {"colour", hex_of(material.colour), PlacedField::Kind::word}};
    if (material.tint > 0)
        fields.push_back({"tint", text_of(static_cast<float>(material.tint) / 255)});
    return {"default", std::move(fields)};
}

std::string option_of(std::string_view word, const std::vector<PlacedField> &fields) {
    std::string text(word);
    for (const PlacedField &field : fields)
        text += "," + field.key + "=" + field.value;
    return text;
}

std::string table_of(const char *option, const char *word_key, std::string_view word,
                     const std::vector<PlacedField> &fields) {
    std::string text = "\n[[" + std::string(option) + "]]\n" + word_key + " = \"" + std::string(word) + "\"\n";
    for (const auto &[key, value, kind] : fields) {
        const bool on = value == "on";
        text += key + " = " +
                (kind == PlacedField::Kind::list   ? "[" + value + "]"
                 : kind == PlacedField::Kind::word ? "\"" + value + "\""
                 : kind == PlacedField::Kind::flag ? (on ? "true" : "false")
                                                   : value) +
                "\n";
    }
    return text;
}

std::optional<bool> casts(const ModelParameters &file, std::size_t light) {
    return file.attributes.lights > 0 ? std::optional(static_cast<int>(light) < file.attributes.lights) : std::nullopt;
}

// The value of --ground.
const char *ground_word(const GroundPlane &ground) {
    return !ground.texture ? "plain" : ground.texture->kind == TextureKind::marble ? "marble" : "wood";
}

// The materials that --material replaces: not those of round points and of the ground, which the builder adds behind
// the scan's.
std::span<const Material> of_object(const Appearance &appearance, const ModelParameters &file) {
    const bool ground_is_last =
        file.ground && appearance.materials.size() > 1 && file.ground->material + 1U == appearance.materials.size();
    const auto round = std::find_if(file.materials.begin(), file.materials.end(), is_round);
    const auto before_round = static_cast<std::size_t>(round - file.materials.begin());
    return std::span(appearance.materials)
        .first(std::min(appearance.materials.size() - (ground_is_last ? 1 : 0), before_round));
}

} // namespace

std::string shell_quoted(std::string_view word) {
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,/:@%";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos)
        return std::string(word);
    std::string text = "'";
    for (const char c : word)
        text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

std::string light_as_option(const Light &light, const Grid &grid, std::optional<bool> casts) {
    return option_of(kKinds[static_cast<std::size_t>(light.kind)], fields_of(light, grid, casts));
}

std::string material_as_option(const Material &material) {
    const auto [word, fields] = fields_of(material);
    return option_of(word, fields);
}

std::string scene_as_options(const Appearance &appearance, const ModelParameters &file) {
    std::string text;
    const auto add = [&](const char *option, const std::string &value) {
        text += std::string(" ") + option + " " + shell_quoted(value);
    };
    const std::vector<Light> lights = lights_to_keep(appearance, file);
    for (std::size_t l = 0; l < lights.size(); ++l)
        add("--light", light_as_option(lights[l], file.grid, casts(file, l)));
    if (file.attributes.lights > 0)
        text += " --shadows";
    for (const Material &material : of_object(appearance, file))
        add("--material", material_as_option(material));
    if (file.ground) {
        add("--ground", ground_word(*file.ground));
        add("--ground-material", material_as_option(appearance.materials[file.ground->material]));
    }
    return text;
}

std::string scene_as_recipe(const Appearance &appearance, const ModelParameters &file, const std::string &name) {
    constexpr std::array<const char *, 3> kUp{"y", "z", "x"};
    std::string text = "# Lights and materials of " + name +
                       ", as pbm-view showed them.\n# pbm-build --recipe THIS_FILE SCAN -o MODEL.pbvg\n";
    text += "up = \"" + std::string(kUp[static_cast<std::size_t>(file.grid.up)]) + "\"\n";
    if (file.attributes.lights > 0)
        text += "shadows = true\n";
    if (file.ground)
        text += "ground = \"" + std::string(ground_word(*file.ground)) + "\"\nground-material = \"" +
                material_as_option(appearance.materials[file.ground->material]) + "\"\n";
    const std::vector<Light> lights = lights_to_keep(appearance, file);
    for (std::size_t l = 0; l < lights.size(); ++l) {
        const Light &light = lights[l];
        text += table_of("light", "kind", kKinds[static_cast<std::size_t>(light.kind)],
                         fields_of(light, file.grid, casts(file, l)));
    }
    for (const Material &material : of_object(appearance, file)) {
        const auto [word, fields] = fields_of(material);
        text += table_of("material", "name", word, fields);
    }
    return text;
}

} // namespace pbm
