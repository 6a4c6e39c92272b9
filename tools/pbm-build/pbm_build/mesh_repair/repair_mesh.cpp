#include "pbm_build/mesh_repair/repair_mesh.h"

#include "pbm_build/mesh_repair/mesh_report.h"

namespace pbm::build {

Status repair_mesh(Surface &surface, const MeshRequest &request, int threads, BuildStatistics &statistics) {
    (void)threads;
    if (!request.any())
        return {};
    if (surface.triangles.empty()) {
        statistics.report("--mesh-report", Fate::dropped, "there are no faces", surface.name);
        return {};
    }
    if (surface.triangles.size() > kMaxMeshFaces)
        return too_large(std::to_string(surface.triangles.size()) + " faces; meshes of up to " +
                         std::to_string(kMaxMeshFaces) + " can be examined and repaired");
    WeldedMesh mesh = weld(surface);
    const Sheets sheets = find_sheets(mesh);
    const Borders borders = find_borders(mesh, sheets, 0);
    statistics.meshes.push_back(figures_of(surface, mesh, sheets, borders));
    statistics.meshes.back().state = "as read";
    return {};
}

} // namespace pbm::build
