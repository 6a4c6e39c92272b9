// A mountain valley as an airborne laser scanner would deliver it: a height field in flight strips.
#pragma once

#include "point_scan.h"

#include "pbm-sample/noise/jet.h"

namespace pbm::sample {

inline constexpr float kTerrainEdge = 4096; // metres; the land is a square, centred on the origin

// Height above the river, metres, and its slopes by x and z. Based on: Musgrave, Kolb, Mace. The Synthesis and
// Rendering of Eroded Fractal Terrains. 1989; Musgrave. Procedural Fractal Terrains, in Texturing and Modeling. 1994
// (ridged multifractal).
Jet2 terrain_height(Float4 x, Float4 z, std::uint32_t seed);

// Eight flight strips along x, flown to and fro; across a strip lie scan lines, swept to and fro. Seen from above every
// point lies in a cell of its own, and all cells of a strip have nearly the same area. The scanner's noise moves a
// point vertically, by up to 1/16 of the spacing and 5 cm. 1 <= points <= kMaxPoints.
PointScan make_terrain(std::uint64_t points, std::uint32_t seed);

} // namespace pbm::sample
