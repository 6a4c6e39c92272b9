#include "viewer/pbm-view/light/model_notes.h"

#include "pbm_format/model/material_presets.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>

namespace pbm {
namespace {

using Json = nlohmann::ordered_json;

std::string text_at(const Json &object, const char *key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// The words of --material in the options that pbm-build has recorded.
std::vector<std::string> material_words(const Json &metadata) {
    const auto options = metadata.find("options");
    if (options == metadata.end() || !options->is_object() || !options->contains("material"))
        return {};
    const Json &given = (*options)["material"];
    std::vector<std::string> words;
    const auto add = [&](const Json &item) {
        const std::string text = item.is_string() ? item.get<std::string>() : std::string();
        words.push_back(text.substr(0, text.find(',')));
    };
    if (given.is_array())
        std::for_each(given.begin(), given.end(), add);
    else
        add(given);
    return words;
}

} // namespace

ModelNotes read_notes(std::string_view metadata) {
    const Json json = Json::parse(metadata, nullptr, false);
    if (!json.is_object())
        return {};
    return {.name = text_at(json, "name"),
            .credit = text_at(json, "credit"),
            .licence = text_at(json, "licence"),
            .materials = material_words(json),
            .view = start_view(metadata)};
}

std::string light_name(const Light &light, std::size_t index) {
    constexpr std::array<const char *, 3> kKinds{"directional", "point", "spot"};
    return "Light " + std::to_string(index + 1) + " (" + kKinds[static_cast<std::size_t>(light.kind)] + ")";
}

std::string material_name(const Material &material, std::size_t index, const ModelNotes &notes) {
    std::string number = "Material " + std::to_string(index + 1);
    for (const MaterialPreset &preset : kMaterialPresets)
        if (preset.material == material)
            return number + " (" + std::string(preset.name) + ")";
    if (index < notes.materials.size() && material_preset(notes.materials[index]) != nullptr)
        return number + " (" + notes.materials[index] + ", changed)";
    return number;
}

} // namespace pbm
