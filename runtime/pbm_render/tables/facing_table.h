// Back-face culling per normal instead of per point.
// Based on: Zhang, Hoff. Fast Backface Culling Using Normal Masks. 1997; dissertation section 4.2
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace pbm {

// Which way a normal faces, for all points within a cube.
enum class Facing : std::uint8_t {
    away,  // away from the eye, everywhere in the cube
    some,  // depends on the point
    front, // towards the eye, everywhere in the cube
    both,  // two-sided
};

// One entry per stored normal value, two-sided bit included: [2 * kNormalCount]; a larger table holds round points
// behind them, which face the eye. The entries hold for every point of the cube with this centre and half edge, in
// model space.
void mark_facing(const glm::dvec3 &eye, const glm::dvec3 &centre, double half_edge, std::vector<Facing> &facing);

} // namespace pbm
