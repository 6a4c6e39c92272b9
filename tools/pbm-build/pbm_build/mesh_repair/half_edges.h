// The mesh as half-edges of OpenMesh, and the loops of its border.
// Based on: Gueziec, Taubin, Lazarus, Horn. Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces.
// 2001
#pragma once

#include "pbm_build/mesh_repair/sheets.h"

namespace pbm::build {

// A closed walk along the border. It passes no vertex twice: holes that touch in a vertex are loops of their own.
struct Loop {
    std::vector<HalfEdge> sides; // of the faces beside it, in its order; faces that continue the sheet run against them
    std::uint64_t open_sides = 0; // at edges with one face; the others are complex or cut
};

struct Borders {
    std::vector<Loop> loops;            // with an open side; their order does not depend on the file's
    std::uint64_t complex_vertices = 0; // whose faces are more than one fan
};

// Half-edge structures represent neither complex edges nor complex vertices nor two windings: the mesh is cut there
// (local cutting, section 3 of the paper), so that no face is lost. A cut is no border.
Borders find_borders(const WeldedMesh &mesh, const Sheets &sheets);

} // namespace pbm::build
