#include "pbm_build/mesh_repair/sheets.h"

#include "pbm_build/surface/face_normal.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

constexpr std::uint32_t kNoSheet = std::numeric_limits<std::uint32_t>::max();

// Visits the faces of the sheet of `first`. Two faces are wound alike if they pass their common edge in opposite
// directions. `queue` is scratch memory.
void flood(WeldedMesh &mesh, std::uint32_t first, Sheets &sheets, std::vector<std::uint32_t> &queue) {
    const auto index = static_cast<std::uint32_t>(sheets.sheets.size());
    bool is_cut = false;
    queue.assign(1, first);
    sheets.sheet_of[first] = index;
    for (std::size_t at = 0; at < queue.size(); ++at) {
        const std::uint32_t face = queue[at];
        for (HalfEdge h = 3 * face; h < 3 * face + 3; ++h) {
            const HalfEdge mate = mesh.mates[h];
            if (!is_mate(mate))
                continue;
            const std::uint32_t other = mate / 3;
            const auto turned =
                static_cast<std::uint8_t>(sheets.turned[face] ^ (mesh.from(h) == mesh.from(mate) ? 1 : 0));
            if (sheets.sheet_of[other] == kNoSheet) {
                sheets.sheet_of[other] = index;
                sheets.turned[other] = turned;
                queue.push_back(other);
            } else if (sheets.turned[other] != turned) {
                mesh.mates[h] = mesh.mates[mate] = kCut;
                sheets.cuts.push_back({h, mate});
                is_cut = true;
            }
        }
    }
    sheets.one_sided += is_cut ? 1 : 0;
    sheets.sheets.emplace_back();
}

// Sums up areas and volumes. Volumes are those of the cones to the first corner of the sheet.
void measure(const WeldedMesh &mesh, Sheets &sheets) {
    std::vector<double> majority(sheets.sheets.size()); // area that is not turned - area that is
    std::vector<glm::dvec3> origins(sheets.sheets.size());
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        Sheet &sheet = sheets.sheets[sheets.sheet_of[i]];
        const auto &corners = mesh.faces[i].corners;
        glm::dvec3 &origin = origins[sheets.sheet_of[i]];
        const glm::dvec3 &a = mesh.positions[corners[0]];
        if (sheet.faces++ == 0)
            origin = a;
        const glm::dvec3 normal = face_normal(a, mesh.positions[corners[1]], mesh.positions[corners[2]]);
        const double area = glm::length(normal) / 2, volume = glm::dot(a - origin, normal) / 6;
        sheet.area += area;
        if (mesh.both_ways[i] == 0) {
            sheet.volume += sheets.turned[i] != 0 ? -volume : volume;
            majority[sheets.sheet_of[i]] += sheets.turned[i] != 0 ? -area : area;
        }
        for (std::size_t side = 3 * i; side < 3 * i + 3; ++side) {
            sheet.open_sides += mesh.mates[side] == kBoundary ? 1 : 0;
            sheet.other_sides += mesh.mates[side] == kComplex || mesh.mates[side] == kCut ? 1 : 0;
        }
    }
    for (std::size_t i = 0; i < sheets.sheets.size(); ++i) // from here on the larger side is that which is not turned
        if (majority[i] < 0)
            sheets.sheets[i].volume = -sheets.sheets[i].volume;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        if (majority[sheets.sheet_of[i]] < 0)
            sheets.turned[i] ^= 1;
        sheets.against += sheets.turned[i] != 0 && mesh.both_ways[i] == 0 ? 1 : 0;
    }
}

void find_parts(const WeldedMesh &mesh, Sheets &sheets) {
    JoinedSets sets(sheets.sheets.size());
    for (const WeldedMesh::ComplexSide &c : mesh.complex_sides)
        sets.join(sheets.sheet_of[c.side / 3], sheets.sheet_of[c.first / 3]);
    for (std::uint32_t i = 0; i < sheets.sheets.size(); ++i) {
        Sheet &sheet = sheets.sheets[i];
        const std::uint32_t first = sets.find(i); // at most i
        sheet.part = first == i ? static_cast<std::uint32_t>(sheets.parts.size()) : sheets.sheets[first].part;
        if (first == i)
            sheets.parts.emplace_back();
        MeshPart &part = sheets.parts[sheet.part];
        part.faces += sheet.faces;
        part.open_sides += sheet.open_sides;
        part.area += sheet.area;
    }
}

} // namespace

bool Sheet::has_outside() const {
    constexpr double kClear = 0.01; // a sphere has 0.094
    return open_sides == 0 && (other_sides == 0 || std::fabs(volume) > kClear * area * std::sqrt(area));
}

Sheets find_sheets(WeldedMesh &mesh) {
    Sheets sheets;
    sheets.sheet_of.assign(mesh.faces.size(), kNoSheet);
    sheets.turned.assign(mesh.faces.size(), 0);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t i = 0; i < mesh.faces.size(); ++i)
        if (sheets.sheet_of[i] == kNoSheet)
            flood(mesh, i, sheets, queue);
    measure(mesh, sheets);
    find_parts(mesh, sheets);
    return sheets;
}

} // namespace pbm::build
