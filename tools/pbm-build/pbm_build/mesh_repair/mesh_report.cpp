#include "pbm_build/mesh_repair/mesh_report.h"

#include <algorithm>

namespace pbm::build {

MeshFigures figures_of(const Surface &surface, const WeldedMesh &mesh, const Sheets &sheets, const Borders &borders) {
    std::vector<bool> used(mesh.positions.size());
    for (const glm::uvec3 &t : surface.triangles)
        for (int corner = 0; corner < 3; ++corner)
            used[mesh.vertex_of[t[corner]]] = true;
    std::vector<bool> has_face(mesh.positions.size());
    for (const WeldedMesh::Face &face : mesh.faces)
        for (const std::uint32_t vertex : face.corners)
            has_face[vertex] = true;
    MeshFigures figures;
    figures.input = surface.name;
    figures.positions = surface.positions.size();
    figures.vertices = static_cast<std::uint64_t>(std::count(has_face.begin(), has_face.end(), true));
    figures.isolated_vertices = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), false));
    figures.edges = mesh.edges;
    figures.faces = mesh.faces.size();
    figures.repeated_faces = mesh.repeated.size();
    figures.flat_faces = mesh.flat.size();
    figures.parts = sheets.parts.size();
    double area = 0, largest = 0;
    for (const MeshPart &part : sheets.parts) {
        area += part.area;
        figures.closed_parts += part.open_sides == 0 ? 1 : 0;
        if (part.area > largest || figures.largest_part_faces == 0) {
            largest = part.area;
            figures.largest_part_faces = part.faces;
        }
    }
    figures.largest_part_share = area > 0 ? largest / area : 0;
    figures.border_edges = mesh.boundary_edges;
    figures.border_loops = borders.loops.size();
    for (const Loop &loop : borders.loops)
        figures.longest_loop = std::max(figures.longest_loop, loop.open_sides);
    figures.complex_edges = mesh.complex_edges;
    figures.complex_vertices = borders.complex_vertices;
    figures.turned_faces = sheets.against;
    for (const Sheet &sheet : sheets.sheets)
        figures.inward_sheets += sheet.has_outside() && sheet.volume < 0 ? 1 : 0;
    figures.one_sided_sheets = sheets.one_sided;
    figures.euler_characteristic = static_cast<std::int64_t>(figures.vertices) -
                                   static_cast<std::int64_t>(figures.edges) + static_cast<std::int64_t>(figures.faces);
    // Of each part: characteristic = 2 - 2 genus - loops.
    if (figures.faces > 0 && figures.complex_edges == 0 && figures.complex_vertices == 0 && sheets.cuts.empty())
        figures.genus =
            static_cast<std::uint64_t>(2 * static_cast<std::int64_t>(figures.parts) -
                                       static_cast<std::int64_t>(figures.border_loops) - figures.euler_characteristic) /
            2;
    return figures;
}

} // namespace pbm::build
