// Normals of faces' corners: smooth across gentle edges, separate at creases, flat on planes.
// Based on: Gouraud. Continuous Shading of Curved Surfaces. 1971 (means of the adjacent faces)
// Based on: ISO/IEC 19775-1 (X3D), section 11.2.3 (crease angle: faces that meet at less are shaded smoothly)
#pragma once

#include "pbm_build/surface/short_normal.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Faces within so much of one plane count as one face.
inline constexpr double kPlanarDegrees = 0.1;

// A surface is constructed, not scanned, where so much of its area has a neighbour in the same plane. Measured: scans
// have up to 0.15, constructed parts 0.33 or more.
inline constexpr double kMinPlanarShare = 0.3;

// Edges at which the faces meet at so many degrees or more are creases. On scans noise tilts neighbouring faces: at 44
// degrees the bunny loses 0.6 dB beside rays. 44 degrees divide the edges of an octagon's prism from a nonagon's.
inline constexpr double kScannedCrease = 75, kConstructedCrease = 44;

// A plane that is so many times larger than another gives their common corners its own normal.
inline constexpr double kDominantArea = 16;

// At a vertex of more faces each has its own normal. Bounds the time for the hub of a large fan.
inline constexpr std::size_t kMaxFacesAtVertex = 256;

// Fills the zero entries of `normals` [positions], the normals of the vertices. The normal of a face's corner there is
// the mean of the unit normals of those faces of the vertex that meet this face at less than Surface::crease_angle, or
// the angle for its shape; or that have its smoothing group, where the file has such. Needles, whose direction rounding
// determines, make no creases and do not count at them. On a constructed surface
//   - faces in one plane count once;
//   - faces in a plane of less than 1 / kDominantArea of the area of the largest one do not count.
// `sign`: -1 if the faces are wound inwards. A vertex whose corners differ is split: appends copies to the vertices
// with triangles, and renumbers triangles. Sums are integers, so the order of faces and vertices does not matter.
//
// errors  too_large  more vertices than 32 bits can number
Status add_corner_normals(Surface &surface, std::vector<ShortNormal> &normals, double sign, int threads);

// The share of the area, 0..1, whose faces have a neighbour in the same plane.
double planar_share(const Surface &surface, int threads);

} // namespace pbm::build
