// How a light sees a model: the projections of its shadow maps.
#pragma once

#include "pbm_bake/shadow_casters.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pbm {

using Vector3 = std::array<double, 3>;

// One projection. With p the place in voxels from `origin`, along the axes, and q = 1 / (1 + inverse_distance p.z):
//
//   u = p.x q, v = p.y q, depth = p.z q
//
// which is parallel for inverse_distance 0 and else has its centre 1 / inverse_distance voxels before the origin.
// Planes stay planes, so depth is linear in u and v across a splat; near the origin a unit of each is one voxel.
struct LightView {
    Vector3 origin;              // in voxels of the casters' level from the grid's minimum corner
    std::array<Vector3, 3> axes; // unit vectors; the last one along the light's travel
    double inverse_distance = 0;
    int face = -1; // 0..5: one of the six views of a light that stands within the model, 90 degrees wide; else -1
    double shift_u = 0, shift_v = 0; // 0..1: of u and v, so that texels of different maps lie differently
};

// Where a light stands seen from the model.
struct LightPlace {
    bool parallel = true;
    Vector3 direction{}; // of travel, unit length: parallel and spot lights
    Vector3 position{};  // in voxels from the grid's minimum corner
    bool spot = false;
};
LightPlace place_light(const Light &light, const ShadowCasters &casters);

// Point number `part` of a light that has a size, as a light without: the first few are spread over all of it, too.
// `size` as ShadowOptions::light_size, but in voxels for lights with a place.
LightPlace part_of_light(const LightPlace &light, const ShadowCasters &casters, int part, double size);

// The views of map number `map`: one, or six from a light that stands within or near the model. Maps differ in how
// their texels lie (turned and shifted) and, for a light that has a size, in the part of it that they see from.
std::vector<LightView> views_of_map(const LightPlace &light, const ShadowCasters &casters, int map, double size);

} // namespace pbm
