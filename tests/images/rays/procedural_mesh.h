// Small closed meshes, about one unit wide around the origin.
#pragma once

#include "triangle_mesh.h"

namespace pbm {

TriangleMesh make_sphere();
TriangleMesh make_torus();
TriangleMesh make_cube(); // 12 triangles, rotated against the axes
TriangleMesh make_bowl(); // a thick half shell: its inside is a concave wall
TriangleMesh make_knot(); // trefoil

} // namespace pbm
