// The colours of a PLY file, in whatever numbers, as sRGB of 8 bits.
#pragma once

#include "pbm_scan/ply/ply_body.h"

#include <string>

namespace pbm::build {

// What became of a group of properties; ends up in the report.
struct PlyOutcome {
    AttributeReport::Fate fate = AttributeReport::Fate::kept;
    std::string note;
};

// Fill `surface.colours` from the vertices' colours, or from the sums of the faces' at each vertex.
//
// uchar is taken as it is. Of other types the highest number of the file tells the range, since the type alone does
// not: float and double up to 2 are 0..1 (a little more is overshoot of a filter, and cut off), everything up to 255 is
// 0..255, up to 65535 it is 0..65535; beyond, the numbers are no colours and are dropped. Negative numbers and NaN are
// 0, but for char, whose numbers are bytes that were declared with a sign. f_dc_0 f_dc_1 f_dc_2 of a Gaussian splat are
// 0.5 + f_dc * 0.28209479 (the constant spherical harmonic), 0..1 in sRGB.
// Based on: Kerbl, Kopanas, Leimkuehler, Drettakis. 3D Gaussian splatting for real-time radiance field rendering. 2023
PlyOutcome finish_colours(const PlyRoles &roles, PlyBody &body, Surface &surface);
PlyOutcome finish_face_colours(const PlyRoles &roles, PlyBody &body, Surface &surface);

} // namespace pbm::build
