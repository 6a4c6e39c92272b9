#include "pbm_build/scene/material_request.h"

#include "pbm_format/model/material_presets.h"
#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

constexpr auto kNames = [] {
    std::array<std::string_view, kMaterialPresets.size()> names;
    for (std::size_t i = 0; i < names.size(); ++i)
        names[i] = kMaterialPresets[i].name;
    return names;
}();

struct Factor {
    std::string_view key;
    float Material::*value;
    float least, most;
    std::string_view range;
};
constexpr std::array kFactors{Factor{"ka", &Material::ka, 0, 1, "0..1"}, Factor{"kd", &Material::kd, 0, 1, "0..1"},
                              Factor{"ks", &Material::ks, 0, 1, "0..1"},
                              Factor{"environment", &Material::environment, 0, 1, "0..1"},
                              Factor{"power", &Material::power, 1e-6F, 1024, "0.000001..1024"}}; // BVG.md 3.6.3

Status set_field(const OptionFields::Field &field, Material &material) {
    if (field.key == "colour" || field.key == "color")
        return take(read_colour(field.value), material.colour);
    if (field.key == "tint") {
        const Result<double> share = read_number(field.value);
        if (!share)
            return share.error();
        if (!(*share >= 0 && *share <= 1))
            return usage_error(in_quotes(field.value) + " is not within 0..1");
        material.tint = static_cast<std::uint8_t>(std::lround(*share * 255));
        return {};
    }
    const auto *const factor =
        std::find_if(kFactors.begin(), kFactors.end(), [&](const Factor &f) { return f.key == field.key; });
    if (factor == kFactors.end())
        return usage_error("a material has ka, kd, ks, power, colour, environment, tint");
    const Result<double> number = read_number(field.value);
    if (!number)
        return number.error();
    const auto value = static_cast<float>(*number);
    if (!(value >= factor->least && value <= factor->most))
        return usage_error(in_quotes(field.value) + " is not within " + std::string(factor->range));
    material.*factor->value = value;
    return {};
}

} // namespace

std::span<const std::string_view> material_names() { return kNames; }

Result<Material> read_material(std::string_view text) {
    const Result<OptionFields> fields = split_fields(text);
    if (!fields)
        return fields.error();
    const MaterialPreset *const preset = material_preset(fields->word.empty() ? "default" : fields->word);
    if (preset == nullptr)
        return usage_error(in_quotes(fields->word) + " is no material" + suggestion(kNames));
    Material material = preset->material;
    for (const OptionFields::Field &field : fields->fields)
        if (Status set = set_field(field, material); !set)
            return usage_error(field.key + ": " + set.error().message);
    return material;
}

} // namespace pbm::build
