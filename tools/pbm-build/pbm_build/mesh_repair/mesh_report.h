// The figures of a mesh for --mesh-report.
#pragma once

#include "pbm_build/mesh_repair/half_edges.h"
#include "pbm_build/report/mesh_figures.h"

namespace pbm::build {

MeshFigures figures_of(const Surface &surface, const WeldedMesh &mesh, const Sheets &sheets, const Borders &borders);

} // namespace pbm::build
