// Orients normals of either sign: neighbours agree, and each connected piece faces its outside.
// Based on: Hoppe, DeRose, Duchamp, McDonald, Stuetzle. Surface Reconstruction from Unorganized Points. 1992, section
// 3.3 (spanning tree over the neighbours, links of highest confidence first)
// Based on: König, Gumhold. Consistent Propagation of Normal Orientations in Point Clouds. 2009 (a link across a curve
// or a sharp edge compares mirrored normals)
#pragma once

#include "pbm_build/normals/fit_planes.h"
#include "pbm_format/model/model.h"

#include <functional>

namespace pbm::build {

struct Orientation {
    Bytes two_sided; // [points] 1: the sign is not known
    std::uint64_t pieces = 0;
    bool of_body = false; // the points look like the surface of a body (outside_view.h)
};

// Orients `fits.normals` in place. Normals with is_given ([points], or empty) = 1 keep their sign and propagate it.
//
// A piece that is mostly closed faces the side from which it is visible. An open sheet is visible from both sides: it
// faces upwards if it lies flat, else +Z if it faces along that axis, else it is two-sided. A point with contradicting
// neighbours is two-sided as well.
Orientation orient_normals(const std::vector<LatticePoint> &points, PlaneFits &fits, const Bytes &is_given, UpAxis up,
                           int threads);

// Orients all normals that are not given towards the scanner. `sight`: from a point (its index) to the scanner; zero:
// the normal stays.
void face_scanner(std::vector<ShortNormal> &normals, const Bytes &is_given,
                  const std::function<glm::dvec3(std::size_t point)> &sight);

} // namespace pbm::build
