// Materials as the user requests them.
#pragma once

#include "pbm_build/scene/option_fields.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <string_view>

namespace pbm::build {

// The names of kMaterialPresets.
std::span<const std::string_view> material_names();

// Parses "bronze", "gold,environment=0.5", "ka=0.2,kd=0.7,colour=#c0a080": a name ("default" if absent), then values
// that replace its own: ka, kd, ks, environment, tint (0..1), power (up to 1,024), colour.
//
// errors  usage  an unknown name or key, a number out of its range
Result<Material> read_material(std::string_view text);

} // namespace pbm::build
