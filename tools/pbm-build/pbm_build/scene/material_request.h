// Materials as a user asks for them.
#pragma once

#include "pbm_build/scene/option_fields.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <string_view>

namespace pbm::build {

// Of the project: default, plaster, clay, plastic, marble, bronze, gold, silver, mirror, and legacy, the dissertation's
// own default: grey, ambient reflection only (its section 5.7).
std::span<const std::string_view> material_names();

// "bronze", "gold,environment=0.5", "ka=0.2,kd=0.7,colour=#c0a080": a name (default if there is none), then what
// differs from it: ka, kd, ks, environment (0..1), power (up to 1,024), colour.
//
// errors  usage  an unknown name or key, a number out of its range
Result<SurfaceMaterial> read_material(std::string_view text);

} // namespace pbm::build
