// Normals of vertices: given ones, or those of the faces' corners.
#pragma once

#include "pbm_build/surface/corner_tangents.h"
#include "pbm_build/surface/short_normal.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

struct VertexNormals {
    std::vector<ShortNormal> normals; // [positions]; zero: a triangle with such a corner has the normal of its plane
    bool faces_point_inward = false;  // most faces disagree with the given normals, which are then trusted
    std::vector<TriangleTangents> tangents{}; // of corner_tangents
};

// Normalises given normals, which win over everything else. A normal that is missing or of length zero is computed from
// the faces (corner_normals.h), which may split vertices; with Surface::crease_angle = 0 it stays zero.
//
// errors  those of add_corner_normals
Result<VertexNormals> vertex_normals(Surface &surface, int threads);

// Whether the given normals mostly disagree with the winding of the faces.
bool faces_point_inward(const Surface &surface, int threads);

} // namespace pbm::build
