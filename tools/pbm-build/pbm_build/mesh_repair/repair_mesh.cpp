#include "pbm_build/mesh_repair/repair_mesh.h"

#include "pbm_build/mesh_repair/fill_holes.h"
#include "pbm_build/mesh_repair/mesh_report.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"

#include <algorithm>

namespace pbm::build {
namespace {

void report_no_faces(const MeshRequest &request, const std::string &input, BuildStatistics &statistics) {
    const auto report = [&](bool requested, const char *option) {
        if (requested)
            statistics.report(Warning::idle_option, option, "there are no faces", input);
    };
    report(request.report, "--mesh-report");
    report(request.winding.requested, "--orient-faces");
    report(request.winding.flip, "--flip-faces");
    report(request.smallest_part.has_value(), "--drop-parts");
    report(request.max_hole_edges.has_value(), "--fill-holes");
}

// One state of the surface, examined.
struct Examined {
    WeldedMesh mesh;
    Sheets sheets;

    explicit Examined(const Surface &surface) : mesh(weld(surface)), sheets(find_sheets(mesh)) {}
};

struct SmallParts {
    std::vector<std::uint8_t> dropped; // [triangles]
    std::uint64_t parts = 0, faces = 0;
    double share = 0; // of the area
};

SmallParts find_small_parts(const Surface &surface, const WeldedMesh &mesh, const Sheets &sheets,
                            const PartSize &size) {
    double area = 0, largest = 0;
    for (const MeshPart &part : sheets.parts) {
        area += part.area;
        largest = std::max(largest, part.area);
    }
    SmallParts small{.dropped = std::vector<std::uint8_t>(surface.triangles.size())};
    std::vector<std::uint8_t> is_small;
    for (const MeshPart &part : sheets.parts) {
        is_small.push_back(part.faces < size.faces || part.area < size.percent / 100 * largest ? 1 : 0);
        small.parts += is_small.back();
        small.share += is_small.back() != 0 && area > 0 ? part.area / area : 0;
    }
    std::vector<std::uint8_t> at_kept(mesh.positions.size()), at_dropped(mesh.positions.size());
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        const bool drop = is_small[sheets.sheets[sheets.sheet_of[i]].part] != 0;
        small.dropped[mesh.faces[i].triangle] = drop ? 1 : 0;
        for (const std::uint32_t vertex : mesh.faces[i].corners)
            (drop ? at_dropped : at_kept)[vertex] = 1;
    }
    for (const WeldedMesh::Repeated &repeated : mesh.repeated)
        small.dropped[repeated.triangle] = small.dropped[mesh.faces[repeated.face].triangle];
    for (const std::uint32_t flat : mesh.flat) { // goes with the part that it touches
        const auto touches = [&](const std::vector<std::uint8_t> &marks) {
            const glm::uvec3 &t = surface.triangles[flat];
            return (marks[mesh.vertex_of[t.x]] | marks[mesh.vertex_of[t.y]] | marks[mesh.vertex_of[t.z]]) != 0;
        };
        small.dropped[flat] = touches(at_dropped) && !touches(at_kept) ? 1 : 0;
    }
    small.faces = static_cast<std::uint64_t>(std::count(small.dropped.begin(), small.dropped.end(), std::uint8_t{1}));
    return small;
}

// Removes triangles, and the vertices that only they have.
void erase(Surface &surface, const std::vector<std::uint8_t> &dropped) {
    std::vector<std::uint8_t> used(surface.positions.size()), was_used(surface.positions.size());
    for (std::size_t i = 0; i < dropped.size(); ++i)
        for (int corner = 0; corner < 3; ++corner)
            (dropped[i] != 0 ? was_used : used)[surface.triangles[i][corner]] = 1;
    std::size_t triangle = 0;
    erase_triangles(surface, [&](const glm::uvec3 &) { return dropped[triangle++] != 0; });
    for (std::size_t i = 0; i < used.size(); ++i)
        was_used[i] = was_used[i] != 0 && used[i] == 0 ? 1 : 0;
    erase_vertices(surface, was_used);
}

Status drop_parts(Surface &surface, Examined &examined, const PartSize &size, BuildStatistics &statistics) {
    const Sheets &sheets = examined.sheets;
    const SmallParts small = find_small_parts(surface, examined.mesh, sheets, size);
    if (small.parts == sheets.parts.size())
        return bad_input("--drop-parts " + to_text(size) +
                         ": every part of the mesh is smaller; choose a size that leaves some of them");
    const std::string limit = size.faces > 0 ? counted(size.faces, "face")
                                             : formatted("%.4g %% of the area of the largest part", size.percent);
    if (small.parts == 0) {
        statistics.report("small parts", Fate::kept,
                          "none: each of " + counted(sheets.parts.size(), "part") + " has at least " + limit,
                          surface.name);
        return {};
    }
    statistics.report(Warning::small_parts, "small parts",
                      std::to_string(small.parts) + " of " + counted(sheets.parts.size(), "part") + ", with " +
                          counted(small.faces, "face") + formatted(" and %.3g %% of the area: ", 100 * small.share) +
                          "smaller than " + limit,
                      surface.name);
    erase(surface, small.dropped);
    examined = Examined(surface);
    return {};
}

Status fill(Surface &surface, Examined &examined, int max_edges, BuildStatistics &statistics) {
    const Borders borders = find_borders(examined.mesh, examined.sheets);
    const Result<FilledHoles> filled =
        fill_holes(surface, examined.mesh, examined.sheets, borders, static_cast<std::size_t>(max_edges));
    if (!filled)
        return filled.error();
    std::string note = filled->loops == 0 ? "none: the mesh has no border"
                                          : std::to_string(filled->filled) + " of " + counted(filled->loops, "loop") +
                                                " of the border closed";
    if (filled->filled > 0)
        note += ", with " + counted(filled->faces, "face") + " and " + counted(filled->vertices, "vertex");
    if (filled->longer > 0)
        note += "; " + std::to_string(filled->longer) + " longer than " +
                counted(static_cast<std::uint64_t>(max_edges), "edge") + ", the shortest of them has " +
                std::to_string(filled->shortest_longer);
    if (filled->not_fillable() > 0)
        note += "; " + std::to_string(filled->not_fillable()) + " left: complex, or without a surface across";
    if (filled->filled == 0) {
        statistics.report("holes", Fate::kept, note, surface.name);
        return {};
    }
    statistics.report(Warning::filled_holes, "holes", note, surface.name);
    examined = Examined(surface);
    return {};
}

void report(const Surface &surface, const Examined &examined, const char *state, BuildStatistics &statistics) {
    const Borders borders = find_borders(examined.mesh, examined.sheets);
    statistics.meshes.push_back(figures_of(surface, examined.mesh, examined.sheets, borders));
    statistics.meshes.back().state = state;
}

} // namespace

Result<PartSize> parse_part_size(const std::string &text) {
    if (text.ends_with('%')) {
        const auto percent = parse_all<double>(text.substr(0, text.size() - 1));
        if (percent && *percent > 0 && *percent <= 100)
            return PartSize{.percent = *percent};
    } else if (const auto faces = parse_all<std::uint64_t>(text); faces && *faces > 0) {
        return PartSize{.faces = *faces};
    }
    return usage_error("Value " + text +
                       " is neither a percentage of the largest part's area, such as 1%, nor a number of faces");
}

std::string to_text(const PartSize &size) {
    return size.faces > 0 ? std::to_string(size.faces) : shortest_text(size.percent) + "%";
}

namespace {

// All but the winding.
Status examine_and_repair(Surface &surface, const MeshRequest &request, BuildStatistics &statistics) {
    if (surface.triangles.size() > kMaxMeshFaces)
        return too_large(std::to_string(surface.triangles.size()) + " faces; meshes of up to " +
                         std::to_string(kMaxMeshFaces) + " can be examined and repaired");
    Examined examined(surface);
    if (request.report)
        report(surface, examined, "as read", statistics);
    if (request.smallest_part)
        if (Status dropped = drop_parts(surface, examined, *request.smallest_part, statistics); !dropped)
            return dropped;
    if (request.max_hole_edges)
        if (Status filled = fill(surface, examined, *request.max_hole_edges, statistics); !filled)
            return filled;
    return {};
}

} // namespace

Status repair_mesh(Surface &surface, const MeshRequest &request, int threads, BuildStatistics &statistics) {
    if (surface.triangles.empty()) {
        report_no_faces(request, surface.name, statistics);
        return {};
    }
    if (request.examines())
        if (Status repaired = examine_and_repair(surface, request, statistics); !repaired)
            return repaired;
    wind_faces(surface, request.winding, threads, statistics);
    if (request.report && request.repairs())
        report(surface, Examined(surface), "as repaired", statistics);
    return {};
}

} // namespace pbm::build
