// Repairs of the faces of a scan, each on request: winding, small parts; and a report of what the faces are like.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>

namespace pbm::build {

// The size that parts need to stay: one of the two.
struct PartSize {
    std::uint64_t faces = 0;
    double percent = 0; // of the area of the largest part
};

// "1.5%", up to 100%, or a number of faces, "200".
//
// errors  usage
Result<PartSize> parse_part_size(const std::string &text);
std::string to_text(const PartSize &size);

struct MeshRequest {
    bool report = false;
    bool orient_faces = false;
    std::optional<PartSize> smallest_part{}; // smaller ones are dropped

    bool any() const { return report || orient_faces || smallest_part; }
};

// In this order: gives the faces of each sheet one winding, that of most of its area, or outwards where the sheet has
// an outside (sheets.h); drops small parts with their vertices. The normal of a vertex all of whose faces are turned is
// turned with them if it agreed with them. Texture coordinates and all attributes follow.
//
// Adds the figures of the mesh, and what was done, to `statistics`. What is done depends on positions and faces alone,
// not on their order, nor on the number of threads. Of a surface without faces it only says that it has none.
//
// errors  too_large  more than kMaxMeshFaces faces (welded_mesh.h)
//         bad_input  all parts are smaller than they need to be to stay
Status repair_mesh(Surface &surface, const MeshRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
