// Sheets and parts of a mesh, and how their faces are wound.
#pragma once

#include "pbm_build/mesh_repair/welded_mesh.h"

namespace pbm::build {

// A sheet is connected through edges with two faces. Its faces get one winding, unless it has one side only, like a
// Moebius strip: then some of its edges are cut. A part is connected through any edges, those with more faces included.
struct Sheet {
    std::uint32_t part = 0;
    std::uint64_t faces = 0;
    double area = 0;               // model units^2
    double volume = 0;             // enclosed by the faces in their common winding; negative: they look inwards
    std::uint64_t open_sides = 0;  // at edges with one face
    std::uint64_t other_sides = 0; // at complex or cut edges

    // A closed sheet looks outwards or inwards. The boundary of a sheet that ends at complex edges may lie in it or
    // not: it counts as closed if its volume is large for its area.
    bool has_outside() const;
};

struct MeshPart {
    std::uint64_t faces = 0, open_sides = 0;
    double area = 0;
};

struct Sheets {
    std::vector<std::uint32_t> sheet_of; // [faces]
    std::vector<std::uint8_t> turned;    // [faces] 1: wound against that side of its sheet which has more area
    std::uint64_t against = 0;           // the number of those, without faces in both windings
    std::vector<Sheet> sheets;
    std::vector<MeshPart> parts;
    std::vector<std::array<HalfEdge, 2>> cuts; // the two sides of each cut edge
    std::uint64_t one_sided = 0;               // sheets with a cut edge
};

// Marks the cut edges in `mesh.mates`.
Sheets find_sheets(WeldedMesh &mesh);

} // namespace pbm::build
