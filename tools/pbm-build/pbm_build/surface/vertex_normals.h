// Normals of vertices: given ones, or means over the adjacent faces.
// Based on: Campbell. Point Based Modelling and Rendering. 2006, section 4.3 (sum of the normals of adjacent faces)
#pragma once

#include "pbm_build/surface/short_normal.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

struct VertexNormals {
    std::vector<ShortNormal> normals; // [positions]; zero where neither the file nor a face gives one
    bool faces_point_inward = false;  // most faces disagree with the given normals, which are then trusted
};

// Normalises given normals. A normal that is missing or of length zero becomes the direction of the sum of the unit
// normals of the adjacent faces; the sums are integers, so the order of the faces does not matter.
VertexNormals vertex_normals(const Surface &surface, int threads);

} // namespace pbm::build
