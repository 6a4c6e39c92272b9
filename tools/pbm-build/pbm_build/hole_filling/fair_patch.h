// Bends a patch so that it continues the surface around, and continues values of its rim.
// Based on: Kobbelt, Campagna, Vorsatz, Seidel. Interactive Multi-Resolution Modeling on Arbitrary Meshes. 1998 (the
// umbrella operator of second order)
// Based on: Liepa. Filling Holes in Meshes. 2003, section 5
#pragma once

#include "pbm_build/hole_filling/refine_patch.h"

#include <span>

namespace pbm::build {

// The weight of a neighbour in the umbrella operator U(v) = sum of weight x (neighbour - v) / sum of weights.
double edge_weight(const glm::dvec3 &from, const glm::dvec3 &to);

// Moves the new vertices to where U(U(v)) = 0, with the weights of the edges before. U of a vertex of the rim includes
// its neighbours outside. Solved directly, in an order that depends on the positions alone.
void fair_patch(Patch &patch, const Rim &rim);

// Values at all vertices with U(value) = 0 at the new ones. `values`: those of the rim.
std::vector<glm::dvec3> continue_values(const Patch &patch, std::span<const glm::dvec3> values);

} // namespace pbm::build
