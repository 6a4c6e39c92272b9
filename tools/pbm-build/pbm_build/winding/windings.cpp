#include "pbm_build/winding/windings.h"

#include "pbm_build/surface/parity_sets.h"
#include "pbm_build/winding/enclosure.h"
#include "system/threads/cancellation.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <span>
#include <tuple>

namespace pbm::build {
namespace {

constexpr double kTie = 1e-9; // of an area: smaller differences may be rounding

void add_face(const Surface &surface, std::size_t i, FaceSums &sums) {
    const glm::uvec3 &t = surface.triangles[i];
    const glm::dvec3 &a = surface.positions[t.x];
    const glm::dvec3 normal = glm::cross(surface.positions[t.y] - a, surface.positions[t.z] - a);
    ++sums.faces;
    sums.area += glm::length(normal) / 2;
    sums.volume += glm::dot(a - surface.positions.front(), normal) / 6;
    sums.vector_area += normal / 2.0;
    if (surface.normals.empty())
        return;
    double along = 0;
    for (int corner = 0; corner < 3; ++corner)
        if (const glm::dvec3 given(surface.normals[t[corner]]); given != glm::dvec3(0))
            along += glm::dot(normal, given / glm::length(given));
    sums.agreeing += along > 0 ? 1 : 0;
    sums.against += along < 0 ? 1 : 0;
}

auto place_of(const glm::dvec3 &p) { return std::tuple(p.x, p.y, p.z); }

// The corners of a face in an order that does not depend on the file's.
auto places_of(const Surface &surface, std::size_t face) {
    const glm::uvec3 &t = surface.triangles[face];
    std::array places{place_of(surface.positions[t.x]), place_of(surface.positions[t.y]),
                      place_of(surface.positions[t.z])};
    std::sort(places.begin(), places.end());
    return places;
}

// Patches with their signs in their sheets.
struct SignedPatches {
    ParitySets signs;
    std::vector<std::array<HalfEdge, 2>> cuts; // at which two windings meet, whatever is turned

    SignedPatches(const EdgeJoins &joins, std::span<const std::array<HalfEdge, 2>> against) : signs(joins.patch_count) {
        const auto patch = [&](HalfEdge h) { return joins.patches[h / 3]; };
        for (const auto &[a, b] : against)
            signs.join(patch(a), patch(b), true);
        for (const auto &sides : against) {
            const ParitySets::Member a = signs.find(patch(sides[0])), b = signs.find(patch(sides[1]));
            if (a.opposite == b.opposite)
                cuts.push_back(sides);
        }
    }
};

// Where cuts are needed, they depend on the order of the edges: it is that of their places.
SignedPatches sign_patches(const Surface &surface, const EdgeJoins &joins) {
    SignedPatches result(joins, joins.against);
    if (result.cuts.empty())
        return result;
    const auto key = [&](const std::array<HalfEdge, 2> &sides) {
        std::array faces{places_of(surface, sides[0] / 3), places_of(surface, sides[1] / 3)};
        std::sort(faces.begin(), faces.end());
        return faces;
    };
    std::vector<std::array<HalfEdge, 2>> sorted = joins.against;
    std::sort(sorted.begin(), sorted.end(), [&](const auto &a, const auto &b) { return key(a) < key(b); });
    return {joins, sorted};
}

void add_patches(SignedPatches &signed_patches, Windings &mesh) {
    mesh.sheet_of.resize(mesh.patches.size());
    mesh.opposite.resize(mesh.patches.size());
    for (std::uint32_t patch = 0; patch < mesh.patches.size(); ++patch) {
        const ParitySets::Member member = signed_patches.signs.find(patch); // the root is the lowest of its set
        const bool is_first = member.root == patch;
        mesh.sheet_of[patch] = is_first ? static_cast<std::uint32_t>(mesh.sheets.size()) : mesh.sheet_of[member.root];
        mesh.opposite[patch] = member.opposite ? 1 : 0;
        if (is_first)
            mesh.sheets.emplace_back();
        WoundSheet &sheet = mesh.sheets[mesh.sheet_of[patch]];
        const FaceSums &sums = mesh.patches[patch];
        sheet.sums.add(sums, member.opposite);
        sheet.majority += member.opposite ? -sums.area : sums.area;
        ++sheet.patches;
    }
    for (std::size_t i = mesh.joins.patches.size(); i-- > 0;)
        mesh.sheets[mesh.sheet_of_face(i)].face = static_cast<std::uint32_t>(i);
}

// Whether the sheet has no majority: neither of given normals nor of area.
bool is_tied(const WoundSheet &sheet) {
    const FaceSums &sums = sheet.sums;
    return sheet.patches > 1 && sums.agreeing == sums.against && std::fabs(sheet.majority) <= kTie * sums.area;
}

// [sheets]: of those that are tied, the face whose corners come first in space. One pass for all of them.
std::vector<std::uint32_t> first_faces(const Surface &surface, const Windings &mesh) {
    std::vector<std::uint32_t> faces(mesh.sheets.size());
    for (std::size_t i = 0; i < faces.size(); ++i)
        faces[i] = mesh.sheets[i].face;
    if (std::none_of(mesh.sheets.begin(), mesh.sheets.end(), is_tied))
        return faces;
    for (std::size_t i = 0; i < surface.triangles.size(); ++i)
        if (const std::uint32_t sheet = mesh.sheet_of_face(i);
            is_tied(mesh.sheets[sheet]) && places_of(surface, i) < places_of(surface, faces[sheet]))
            faces[sheet] = static_cast<std::uint32_t>(i);
    return faces;
}

// Gives sheets of several patches the sign with which most given normals agree, else that of most of their area.
void choose_signs(const Surface &surface, Windings &mesh) {
    std::vector<std::uint8_t> changes(mesh.sheets.size());
    const std::vector<std::uint32_t> first = first_faces(surface, mesh);
    for (std::uint32_t i = 0; i < mesh.sheets.size(); ++i) {
        WoundSheet &sheet = mesh.sheets[i];
        FaceSums &sums = sheet.sums;
        if (sheet.patches == 1)
            continue;
        const bool change = is_tied(sheet)                  ? mesh.opposite[mesh.joins.patches[first[i]]] != 0
                            : sums.agreeing != sums.against ? sums.agreeing < sums.against
                                                            : sheet.majority < 0;
        if (!change)
            continue;
        changes[i] = 1;
        sums.volume = -sums.volume;
        sums.vector_area = -sums.vector_area;
        std::swap(sums.agreeing, sums.against);
    }
    for (std::size_t patch = 0; patch < mesh.patches.size(); ++patch)
        mesh.opposite[patch] ^= changes[mesh.sheet_of[patch]];
}

// Joins sheets at complex edges.
void find_parts(Windings &mesh) {
    ParitySets parts(mesh.sheets.size());
    std::size_t side = 0;
    for (const std::size_t end : mesh.joins.complex_ends)
        for (const std::uint32_t first = mesh.sheet_of_face(mesh.joins.complex[side] / 3); side < end; ++side) {
            const std::uint32_t sheet = mesh.sheet_of_face(mesh.joins.complex[side] / 3);
            ++mesh.sheets[sheet].other_sides;
            parts.join(first, sheet, false);
        }
    for (std::uint32_t i = 0; i < mesh.sheets.size(); ++i) {
        const std::uint32_t first = parts.find(i).root;
        mesh.sheets[i].part = first == i ? static_cast<std::uint32_t>(mesh.parts++) : mesh.sheets[first].part;
    }
}

// Marks sheets that look inwards and lie in a closed sheet that looks outwards.
void find_cavities(const Surface &surface, Windings &mesh) {
    std::vector<glm::dvec3> points;
    std::vector<std::uint32_t> inward;
    std::vector<std::uint8_t> is_outer(mesh.sheets.size());
    for (std::uint32_t i = 0; i < mesh.sheets.size(); ++i) {
        const WoundSheet &sheet = mesh.sheets[i];
        is_outer[i] = sheet.has_outside() && sheet.sums.volume > 0 ? 1 : 0;
        if (!sheet.is_inward())
            continue;
        points.push_back(surface.positions[surface.triangles[sheet.face].x]);
        inward.push_back(i);
    }
    if (inward.empty() || std::find(is_outer.begin(), is_outer.end(), 1) == is_outer.end())
        return;
    std::vector<std::int8_t> signs(surface.triangles.size()); // of the faces of outer sheets
    for (std::size_t i = 0; i < signs.size(); ++i)
        if (is_outer[mesh.sheet_of_face(i)] != 0)
            signs[i] = mesh.opposite[mesh.joins.patches[i]] != 0 ? -1 : 1;
    const std::vector<int> numbers = winding_numbers(surface, signs, points);
    for (std::size_t i = 0; i < inward.size(); ++i)
        mesh.sheets[inward[i]].is_cavity = numbers[i] > 0;
}

} // namespace

// Of few patches several threads sum up blocks, the same ones for any number of threads.
std::vector<FaceSums> sum_patches(const Surface &surface, const EdgeJoins &joins, int threads) {
    const std::size_t faces = surface.triangles.size();
    const std::size_t block = joins.patch_count <= 64 ? 65536 : faces;
    std::vector<std::vector<FaceSums>> blocks((faces + block - 1) / block);
    parallel_blocks(faces, block, threads, [&](std::size_t begin, std::size_t end) {
        std::vector<FaceSums> sums(joins.patch_count);
        for (std::size_t i = begin; i < end; ++i)
            add_face(surface, i, sums[joins.patches[i]]);
        blocks[begin / block] = std::move(sums);
    });
    for (std::size_t i = 1; i < blocks.size(); ++i)
        for (std::size_t patch = 0; patch < joins.patch_count; ++patch)
            blocks[0][patch].add(blocks[i][patch], false);
    return std::move(blocks[0]);
}

Windings find_windings(const Surface &surface, int threads) {
    Windings mesh;
    mesh.joins = join_edges(surface, threads);
    mesh.patches = sum_patches(surface, mesh.joins, threads);
    SignedPatches signed_patches = sign_patches(surface, mesh.joins);
    mesh.cuts = std::move(signed_patches.cuts);
    check_cancelled();
    add_patches(signed_patches, mesh);
    check_cancelled();
    choose_signs(surface, mesh);
    for (const HalfEdge h : mesh.joins.open)
        ++mesh.sheets[mesh.sheet_of_face(h / 3)].open_sides;
    for (const auto &[a, b] : mesh.cuts) {
        WoundSheet &sheet = mesh.sheets[mesh.sheet_of_face(a / 3)];
        sheet.other_sides += 2;
        sheet.is_cut = true;
    }
    find_parts(mesh);
    find_cavities(surface, mesh);
    return mesh;
}

} // namespace pbm::build
