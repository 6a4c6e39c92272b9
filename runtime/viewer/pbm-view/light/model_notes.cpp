#include "viewer/pbm-view/light/model_notes.h"

#include "pbm_format/container/layout.h"
#include "pbm_format/model/material_presets.h"

#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>

namespace pbm {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char *kView = "view", *kOrthographic = "orthographic";

std::string text_at(const Json &object, const char *key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::optional<glm::dvec3> vector_at(const Json &object, const char *key) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_array() || found->size() != 3 ||
        !std::all_of(found->begin(), found->end(), [](const Json &item) { return item.is_number(); }))
        return std::nullopt;
    return glm::dvec3((*found)[0].get<double>(), (*found)[1].get<double>(), (*found)[2].get<double>());
}

Json list_of(const glm::dvec3 &v) { return Json::array({v.x, v.y, v.z}); }

std::optional<SavedView> view_of(const Json &metadata) {
    const auto found = metadata.find(kView);
    if (found == metadata.end() || !found->is_object())
        return std::nullopt;
    const auto position = vector_at(*found, "position"), focal_point = vector_at(*found, "focal_point"),
               up = vector_at(*found, "up");
    const auto angle = found->find("angle");
    if (!position || !focal_point || !up || angle == found->end() || !angle->is_number())
        return std::nullopt;
    const SavedView view{{.position = *position,
                          .focal_point = *focal_point,
                          .up = *up,
                          .view_angle = glm::radians(angle->get<double>()),
                          .orthographic = text_at(*found, "projection") == kOrthographic},
                         angle->get<double>()};
    return is_usable(view.camera) ? std::optional(view) : std::nullopt;
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
            .view = view_of(json)};
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

Result<std::string> with_view(std::string_view metadata, const SavedView &view) {
    Json json = Json::parse(metadata, nullptr, false);
    if (!json.is_object())
        json = Json::object();
    json[kView] = {{"position", list_of(view.camera.position)},
                   {"focal_point", list_of(view.camera.focal_point)},
                   {"up", list_of(view.camera.up)},
                   {"angle", view.view_angle}};
    if (view.camera.orthographic)
        json[kView]["projection"] = kOrthographic;
    std::string text = json.dump();
    if (text.size() > kMaxMetadataBytes)
        return Error{ErrorCode::too_large, 0, "the metadata has no room for the view: it is at most 4,096 bytes"};
    return text;
}

} // namespace pbm
