// Repairs of the faces of a scan: small parts and holes on request, winding (wind_faces.h) always; and a report of what
// the faces are like.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_build/winding/wind_faces.h"
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

// The time to fill a loop grows with the cube of its edges: 1,000 take seconds.
inline constexpr int kMaxHoleEdges = 1000;

struct MeshRequest {
    bool report = false;
    WindingRequest winding{};
    std::optional<PartSize> smallest_part{}; // smaller ones are dropped
    std::optional<int> max_hole_edges{};     // longer loops of the border are left; 3..kMaxHoleEdges

    bool repairs() const { return winding.requested || smallest_part || max_hole_edges; }
    bool examines() const { return report || smallest_part || max_hole_edges; }
};

// In this order: drops small parts with their vertices; fills holes (fill_holes.h), which may close a sheet; winds the
// faces. Texture coordinates and all attributes follow.
//
// Adds the figures of the mesh, and what was done, to `statistics`. What is done depends on positions and faces alone,
// not on their order, nor on the number of threads. Of a surface without faces it only says that it has none.
//
// errors  too_large  more than kMaxMeshFaces faces (welded_mesh.h), those that fill holes included, if more is asked
// for
//                    than the winding
//         bad_input  all parts are smaller than they need to be to stay
Status repair_mesh(Surface &surface, const MeshRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
