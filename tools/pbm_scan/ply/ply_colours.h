// Converts the colours of a PLY file, of any type and range, to sRGB of 8 bits.
#pragma once

#include "pbm_scan/ply/ply_body.h"

#include <string>

namespace pbm::build {

// The fate of a group of properties, for the report.
struct PlyOutcome {
    Fate fate = Fate::kept;
    std::string note;
};

// Fill the colours of the vertices, or those of the faces, of `surface`.
//
// uchar is kept. For other types nearly all values determine the range (conventions/colour_range.h). Negative numbers
// and NaN become 0, except for char, whose numbers are bytes declared with a sign. f_dc_0 f_dc_1 f_dc_2 of a Gaussian
// splat: clouds/gaussian_splats.h.
PlyOutcome finish_colours(const PlyRoles &roles, PlyBody &body, Surface &surface);
PlyOutcome finish_face_colours(const PlyRoles &roles, PlyBody &body, Surface &surface);

} // namespace pbm::build
