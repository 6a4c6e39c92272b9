// How a light sees a model: the projections of its shadow maps.
#pragma once

#include "pbm_bake/shadow_casters.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pbm {

using Vector3 = std::array<double, 3>;

// One projection. Let p be a position in voxels, from `origin` along the axes, and q = 1 / (1 + inverse_distance p.z):
//
//   u = p.x q, v = p.y q, depth = p.z q
//
// It is parallel if inverse_distance is 0; else its centre lies 1 / inverse_distance voxels before the origin. Planes
// stay planes, so depth is linear in u and v across a splat. Near the origin one unit of u, v and depth is one voxel.
struct LightView {
    Vector3 origin;              // in voxels of the casters' level from the grid's minimum corner
    std::array<Vector3, 3> axes; // unit vectors; the last one along the light's travel
    double inverse_distance = 0;
    int face = -1;                   // 0..5: one of six views, 90 degrees wide, of a light within the model; else -1
    double shift_u = 0, shift_v = 0; // 0..1: added to u and v, so that texels of different maps differ
};

// A light relative to the model.
struct LightPlace {
    bool parallel = true;
    Vector3 direction{}; // of travel, unit length: parallel and spot lights
    Vector3 position{};  // in voxels from the grid's minimum corner
    bool spot = false;
};
LightPlace place_light(const Light &light, const ShadowCasters &casters);

// Part number `part` of a light with a size: a light without size. The first few parts already spread over the whole
// light. `size` as ShadowOptions::light_size, but in voxels for lights with a position.
LightPlace part_of_light(const LightPlace &light, const ShadowCasters &casters, int part, double size);

// The views of map number `map`: one, or six if the light stands within or near the model. Maps differ in how their
// texels lie (rotated and shifted) and, if the light has a size, in the part of the light.
std::vector<LightView> views_of_map(const LightPlace &light, const ShadowCasters &casters, int map, double size);

} // namespace pbm
