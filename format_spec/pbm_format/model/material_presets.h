// Named materials: what pbm-build's --material takes and pbm-view's panel offers.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <span>
#include <string_view>

namespace pbm {

struct MaterialPreset {
    std::string_view name;
    Material material;
};

// "legacy" is the dissertation's own default: grey, ambient reflection only (its section 5.7).
inline constexpr std::array<MaterialPreset, 10> kMaterialPresets{{
    {"default", {}},
    {"plaster", {.ka = 0.22F, .kd = 0.75F, .ks = 0.03F, .power = 4, .colour = {228, 223, 214}}},
    {"clay", {.ka = 0.2F, .kd = 0.74F, .ks = 0.06F, .power = 6, .colour = {176, 104, 72}}},
    {"plastic", {.ka = 0.2F, .kd = 0.6F, .ks = 0.4F, .power = 60, .colour = {190, 40, 36}, .environment = 0.04F}},
    {"marble", {.ka = 0.22F, .kd = 0.66F, .ks = 0.3F, .power = 40, .colour = {236, 233, 226}, .environment = 0.06F}},
    {"bronze", {.ka = 0.16F, .kd = 0.5F, .ks = 0.6F, .power = 20, .colour = {158, 106, 56}, .environment = 0.16F}},
    {"gold", {.ka = 0.2F, .kd = 0.5F, .ks = 0.8F, .power = 32, .colour = {224, 170, 62}, .environment = 0.3F}},
    {"silver", {.ka = 0.18F, .kd = 0.4F, .ks = 0.8F, .power = 48, .colour = {206, 208, 212}, .environment = 0.45F}},
    {"mirror", {.ka = 0.1F, .kd = 0.1F, .ks = 0.6F, .power = 200, .colour = {230, 230, 230}, .environment = 1}},
    {"legacy", {.ka = 1, .kd = 0, .ks = 0, .power = 1, .colour = {128, 128, 128}}},
}};

// The preset of this name, or null.
inline const MaterialPreset *material_preset(std::string_view name) {
    for (const MaterialPreset &preset : kMaterialPresets)
        if (preset.name == name)
            return &preset;
    return nullptr;
}

} // namespace pbm
