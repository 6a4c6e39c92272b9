// Whether the shadows baked into a model's points are those of rays.
#pragma once

#include "ray_caster.h"

#include "pbm_format/model.h"

#include <cstdint>
#include <vector>

namespace pbm {

// Of one light, points of the finest level. Two-sided points, which face every light, are left out. Rays start a
// quarter of a voxel above the surface: relief lower than that is below what voxels hold of it. Strict rays start on
// it.
struct FlagFigures {
    std::uint64_t facing = 0;      // normal and direction to the light less than 90 degrees apart
    std::uint64_t lit = 0;         // of those, by rays
    std::uint64_t falsely_lit = 0; // of those, lit by more than half in the file, in shadow by rays
    std::uint64_t falsely_dark = 0;
    std::uint64_t strictly_wrong = 0; // either, by strict rays
};

// One for each light of the model that has a shadow stream. `model` has all its levels.
std::vector<FlagFigures> check_flags(const RayCaster &rays, const Model &model, int threads);

} // namespace pbm
