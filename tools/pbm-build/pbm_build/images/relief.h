// How rough the normal maps of a surface are.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <vector>

namespace pbm::build {

// [k]: how much the normals of a map change within squares of 2^k x 2^k texels that triangles show: the squared chord
// along an edge, as normal_change (grid/grid_choice.h) has it for vertices. A map of one normal has zeros.
using Relief = std::vector<double>;

// [Surface::textures]; empty for images of colours, or where there are none of normals.
std::vector<Relief> measure_relief(const Surface &surface, int threads);

// The squared chord within a square of `edge` texels, which may be no integer, or less than one.
double squared_change(const Relief &relief, double edge);

} // namespace pbm::build
