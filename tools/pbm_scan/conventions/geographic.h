// Degrees of longitude and latitude as metres.
// Based on: National Imagery and Mapping Agency. World Geodetic System 1984, TR8350.2. 2000
#pragma once

#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Replaces positions of longitude and latitude (degrees) and height (`height_metres` each) by metres to the east, to
// the north and upwards of the place on the ellipsoid WGS 84 at the centre of their box. Distances stay true to 1e-8 m;
// the ground of the earth falls away from the plane by 0.08 m at 1 km and by 8 m at 10 km. Sets the unit, the axis and
// the CRS of the surface, and reports the origin. Coordinates that are no degrees stay, which the report says.
void degrees_to_metres(Surface &surface, double height_metres = 1);

// Whether x and y can only be degrees: far smaller than z, within 180 and 90, and away from 0.
bool look_like_degrees(const Surface &surface);

} // namespace pbm::build
