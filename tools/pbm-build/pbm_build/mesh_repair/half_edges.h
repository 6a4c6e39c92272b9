// The mesh as half-edges of OpenMesh, and the loops of its border.
// Based on: Gueziec, Taubin, Lazarus, Horn. Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces.
// 2001
#pragma once

#include "pbm_build/mesh_repair/sheets.h"

namespace pbm::build {

struct Borders {
    // The edges with one face in each closed walk along the border. A loop passes no vertex twice: holes that touch in
    // a vertex are loops of their own. A walk along cuts alone is no loop.
    std::vector<std::uint64_t> loops;
    std::uint64_t complex_vertices = 0; // whose faces are more than one fan
};

// Half-edge structures represent neither complex edges nor complex vertices nor two windings: the mesh is cut there
// (local cutting, section 3 of the paper), so that no face is lost. A cut is no border.
Borders find_borders(const WeldedMesh &mesh, const Sheets &sheets);

} // namespace pbm::build
