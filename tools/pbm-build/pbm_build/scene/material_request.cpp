#include "pbm_build/scene/material_request.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::array<std::string_view, 10> kNames{"default", "plaster", "clay",   "plastic", "marble",
                                                  "bronze",  "gold",    "silver", "mirror",  "legacy"};
constexpr std::array<Material, kNames.size()> kMaterials{{
    {},
    {.ka = 0.22F, .kd = 0.75F, .ks = 0.03F, .power = 4, .colour = {228, 223, 214}, .environment = 0},
    {.ka = 0.2F, .kd = 0.74F, .ks = 0.06F, .power = 6, .colour = {176, 104, 72}, .environment = 0},
    {.ka = 0.2F, .kd = 0.6F, .ks = 0.4F, .power = 60, .colour = {190, 40, 36}, .environment = 0.04F},
    {.ka = 0.22F, .kd = 0.66F, .ks = 0.3F, .power = 40, .colour = {236, 233, 226}, .environment = 0.06F},
    {.ka = 0.16F, .kd = 0.5F, .ks = 0.6F, .power = 20, .colour = {158, 106, 56}, .environment = 0.16F},
    {.ka = 0.2F, .kd = 0.5F, .ks = 0.8F, .power = 32, .colour = {224, 170, 62}, .environment = 0.3F},
    {.ka = 0.18F, .kd = 0.4F, .ks = 0.8F, .power = 48, .colour = {206, 208, 212}, .environment = 0.45F},
    {.ka = 0.1F, .kd = 0.1F, .ks = 0.6F, .power = 200, .colour = {230, 230, 230}, .environment = 1},
    {.ka = 1, .kd = 0, .ks = 0, .power = 1, .colour = {128, 128, 128}, .environment = 0},
}};

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
    const auto *const factor =
        std::find_if(kFactors.begin(), kFactors.end(), [&](const Factor &f) { return f.key == field.key; });
    if (factor == kFactors.end())
        return usage("a material has ka, kd, ks, power, colour, environment");
    const Result<double> number = read_number(field.value);
    if (!number)
        return number.error();
    const auto value = static_cast<float>(*number);
    if (!(value >= factor->least && value <= factor->most))
        return usage(in_quotes(field.value) + " is not within " + std::string(factor->range));
    material.*factor->value = value;
    return {};
}

} // namespace

std::span<const std::string_view> material_names() { return kNames; }

Result<Material> read_material(std::string_view text) {
    const Result<OptionFields> fields = split_fields(text);
    if (!fields)
        return fields.error();
    const auto name = fields->word.empty() ? kNames.begin() : std::find(kNames.begin(), kNames.end(), fields->word);
    if (name == kNames.end())
        return usage(in_quotes(fields->word) + " is no material" + suggestion(kNames));
    Material material = kMaterials[static_cast<std::size_t>(name - kNames.begin())];
    for (const OptionFields::Field &field : fields->fields)
        if (Status set = set_field(field, material); !set)
            return usage(field.key + ": " + set.error().message);
    return material;
}

} // namespace pbm::build
