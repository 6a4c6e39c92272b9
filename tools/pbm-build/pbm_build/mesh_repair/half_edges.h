// The mesh as half-edges of OpenMesh, and the loops of its border.
// Based on: Gueziec, Taubin, Lazarus, Horn. Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces.
// 2001
#pragma once

#include "pbm_build/mesh_repair/sheets.h"

namespace pbm::build {

// A closed walk along the border, with the hole on its left. It passes no vertex twice: holes that touch in a vertex
// are loops of their own.
struct BorderLoop {
    struct Step {
        HalfEdge side;        // of the face on the right
        std::uint32_t vertex; // where the step begins
    };
    std::vector<Step> steps;
    std::uint64_t open_sides = 0; // steps along edges with one face; others are along complex or cut edges
    // [steps] the vertices that edges connect with the step's vertex; only where the loop is open and has at most
    // `max_ring_steps` steps.
    std::vector<std::vector<std::uint32_t>> rings;

    bool is_hole() const { return open_sides == steps.size(); }
};

struct Borders {
    std::vector<BorderLoop> loops;      // those with open sides
    std::uint64_t complex_vertices = 0; // whose faces are more than one fan
};

// Half-edge structures represent neither complex edges nor complex vertices nor two windings: the mesh is cut there
// (local cutting, section 3 of the paper), so that no face is lost. A cut is no border.
Borders find_borders(const WeldedMesh &mesh, const Sheets &sheets, std::size_t max_ring_steps);

} // namespace pbm::build
