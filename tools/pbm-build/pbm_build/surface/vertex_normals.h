// Normals of vertices: as given, or from the faces around them.
// Based on: Campbell. Point Based Modelling and Rendering. 2006, section 4.3 (sum of the normals of adjacent faces)
#pragma once

#include "pbm_build/surface/short_normal.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

struct VertexNormals {
    std::vector<ShortNormal> normals; // [positions]; zero where neither the file nor a face has one
    bool faces_point_inward = false;  // the given normals mostly disagree with the winding of the faces: trust them
};

// Given normals are normalised; where one has no length, and everywhere if none are given, the normal is the direction
// of the sum of the unit normals of the faces around the vertex, summed in integers, so that their order does not
// matter.
VertexNormals vertex_normals(const Surface &surface, int threads);

} // namespace pbm::build
