// Bends a patch so that it continues the surface around, and continues values of its rim.
// Based on: Liepa. Filling Holes in Meshes. 2003, section 5
// Based on: Botsch, Kobbelt. An Intuitive Framework for Real-Time Freeform Modeling. 2004, section 3 (the Laplacian of
// second order with weights of cotangents and areas)
#pragma once

#include "pbm_build/hole_filling/refine_patch.h"

#include <span>

namespace pbm::build {

// Of a face at `apex`: the weight of the edge from `from` to `to` in the Laplacian
//   L(v) = sum of weight x (v - neighbour) / area of v
// is the sum of both faces' cotangents. Limited to +-20, an angle of 3 degrees.
double cotangent_at(const glm::dvec3 &apex, const glm::dvec3 &from, const glm::dvec3 &to);

// Moves the new vertices to where L(L(v)) = 0, with the weights of the shape before. L of a vertex of the rim includes
// the faces outside. Solved directly, in an order that depends on the positions alone.
void fair_patch(Patch &patch, const Rim &rim);

// Values at all vertices with L(value) = 0 at the new ones: none is beyond those of the rim. `values`: of the rim.
std::vector<glm::dvec3> continue_values(const Patch &patch, std::span<const glm::dvec3> values);

} // namespace pbm::build
