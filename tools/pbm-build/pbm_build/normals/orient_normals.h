// Turns normals of either sign so that neighbours agree, and each connected piece to its outside.
// Based on: Hoppe, DeRose, Duchamp, McDonald, Stuetzle. Surface Reconstruction from Unorganized Points. 1992, section
//           3.3 (spanning tree over the neighbours, the surest links first)
//           König, Gumhold. Consistent Propagation of Normal Orientations in Point Clouds. 2009 (a link across a curve
//           or a sharp edge compares mirrored normals)
#pragma once

#include "pbm_build/normals/fit_planes.h"
#include "pbm_format/model/model.h"

#include <optional>

namespace pbm::build {

struct Orientation {
    Bytes two_sided; // [points] 1: the sign is not known
    std::uint64_t pieces = 0;
};

// Turns `fits.normals` in place. Where `is_given` ([points], or empty) is 1 they keep their sign and hand it on.
//
// A piece that is closed by and large is turned to the side from which it is seen. An open sheet is seen from both
// sides: it is turned upwards if it lies flat, else towards +Z if it faces along that axis, else it is two-sided. So is
// a point whose neighbours contradict each other.
Orientation orient_normals(const std::vector<LatticePoint> &points, PlaneFits &fits, const Bytes &is_given, UpAxis up,
                           int threads);

// Turns all normals to the side of `viewpoint` (lattice coordinates), but those that are given.
void face_viewpoint(const std::vector<LatticePoint> &points, std::vector<ShortNormal> &normals, const Bytes &is_given,
                    const glm::dvec3 &viewpoint);

} // namespace pbm::build
