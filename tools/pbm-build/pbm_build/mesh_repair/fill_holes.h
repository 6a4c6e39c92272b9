// Closes the loops of a mesh's border with patches (hole_filling/).
#pragma once

#include "pbm_build/mesh_repair/half_edges.h"

namespace pbm::build {

struct FilledHoles {
    std::uint64_t loops = 0, filled = 0, faces = 0, vertices = 0;
    std::uint64_t longer = 0, shortest_longer = 0; // loops of more edges than requested; edges of the shortest of them
    std::uint64_t not_fillable() const { return loops - filled - longer; }
};

// Fills each loop of `borders` that has at most `max_edges` edges, all of them open, unless every triangulation of it
// has an edge of the mesh or a face without area. Faces are wound as most of their sheet is (Sheets::turned). New
// vertices are continued from the rim, in linear light, or have
//   normals       zero: they will be those of the faces
//   attributes of one byte    those of the nearest vertex of the rim
//   radii, fields, stations   none: these were measured
// In a surface with images, patches have no image, and vertices of their own at the rim, with the colours of the images
// there. What is done does not depend on the order of the surface's arrays.
//
// errors  too_large  more vertices than kMaxVertices or faces than kMaxMeshFaces
Result<FilledHoles> fill_holes(Surface &surface, const WeldedMesh &mesh, const Sheets &sheets, const Borders &borders,
                               std::size_t max_edges);

} // namespace pbm::build
