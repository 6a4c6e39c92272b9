#include "pbm_build/winding/wind_faces.h"

#include "pbm_build/surface/face_normal.h"
#include "pbm_build/surface/vertex_normals.h"
#include "pbm_build/winding/turn_faces.h"
#include "pbm_build/winding/windings.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <span>

namespace pbm::build {
namespace {

constexpr double kFewContradictions = 1e-3; // of the faces of a closed surface: needles

// What is done, and what the report says of it.
struct Changes {
    bool orients = false;
    std::vector<std::uint8_t> turned; // [patches]; not those that are turned on request alone
    TurnedFaces faces{};
    std::uint64_t inward = 0, mixed = 0, one_sided = 0; // sheets
    std::uint64_t inward_normals = 0, removed_normals = 0;
};

Changes choose_changes(const Windings &mesh, const WindingRequest &request) {
    const bool orients = !request.keep && (request.requested || !request.flip);
    Changes changes{.orients = orients, .turned = std::vector<std::uint8_t>(mesh.patches.size())};
    for (const WoundSheet &sheet : mesh.sheets) {
        changes.one_sided += sheet.is_cut ? 1 : 0;
        changes.mixed += orients && sheet.patches > 1 ? 1 : 0;
        changes.inward += orients && sheet.patches == 1 && sheet.is_inward() && !sheet.is_cavity ? 1 : 0;
    }
    for (std::size_t patch = 0; patch < mesh.patches.size(); ++patch) {
        const WoundSheet &sheet = mesh.sheets[mesh.sheet_of[patch]];
        const bool turned = (mesh.opposite[patch] != 0) != (sheet.is_inward() && !sheet.is_cavity);
        changes.turned[patch] = orients && turned ? 1 : 0;
    }
    return changes;
}

// Where two windings meet, both sides are shown.
void show_both_sides(Surface &surface, const Windings &mesh) {
    if (!mesh.cuts.empty())
        surface.two_sided.resize(surface.positions.size());
    for (const auto &sides : mesh.cuts)
        for (const HalfEdge h : sides)
            for (const HalfEdge corner : {h, next_side(h)})
                surface.two_sided[surface.triangles[corner / 3][static_cast<int>(corner % 3)]] = 1;
}

// [positions] 1: a corner of a face whose sheet is in `sheets`.
std::vector<std::uint8_t> corners_of(const Surface &surface, const Windings &mesh,
                                     const std::vector<std::uint8_t> &sheets) {
    std::vector<std::uint8_t> corners(surface.positions.size());
    for (std::size_t i = 0; i < surface.triangles.size(); ++i)
        if (sheets[mesh.sheet_of_face(i)] != 0)
            for (int corner = 0; corner < 3; ++corner)
                corners[surface.triangles[i][corner]] = 1;
    return corners;
}

// Turns the given normals of closed sheets of which clearly most, two thirds, point inwards. `sums`: of the patches as
// they are wound now.
void turn_inward_normals(Surface &surface, const Windings &mesh, std::span<const FaceSums> sums, Changes &changes) {
    std::vector<FaceSums> sheets(mesh.sheets.size());
    for (std::size_t patch = 0; patch < sums.size(); ++patch)
        sheets[mesh.sheet_of[patch]].add(sums[patch], false);
    std::vector<std::uint8_t> wrong(mesh.sheets.size());
    for (std::size_t i = 0; i < wrong.size(); ++i)
        wrong[i] = mesh.sheets[i].has_outside() && sheets[i].against > 2 * sheets[i].agreeing ? 1 : 0;
    if (std::find(wrong.begin(), wrong.end(), 1) == wrong.end())
        return;
    const std::vector<std::uint8_t> corners = corners_of(surface, mesh, wrong);
    for (std::size_t i = 0; i < corners.size(); ++i)
        if (corners[i] != 0) {
            surface.normals[i] = -surface.normals[i];
            ++changes.inward_normals;
        }
}

// Removes the given normals of sheets with two windings that contradict the faces around them.
void remove_wrong_normals(Surface &surface, const Windings &mesh, Changes &changes) {
    std::vector<std::uint8_t> mixed(mesh.sheets.size());
    for (std::size_t i = 0; i < mixed.size(); ++i)
        mixed[i] = mesh.sheets[i].patches > 1 ? 1 : 0;
    std::vector<double> agreement(surface.positions.size());
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const glm::uvec3 &t = surface.triangles[i];
        const glm::dvec3 normal = face_normal(surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]);
        for (int corner = 0; corner < 3 && mixed[mesh.sheet_of_face(i)] != 0; ++corner)
            agreement[t[corner]] += glm::dot(normal, glm::dvec3(surface.normals[t[corner]]));
    }
    for (std::size_t i = 0; i < agreement.size(); ++i)
        if (agreement[i] < 0) {
            surface.normals[i] = glm::vec3(0);
            ++changes.removed_normals;
        }
}

// Each complex edge is passed as often in one direction as in the other.
bool is_balanced(const Surface &surface, const Windings &mesh, const Changes &changes) {
    std::size_t at = 0;
    for (const std::size_t end : mesh.joins.complex_ends) {
        std::int64_t balance = 0;
        const auto start = [&](HalfEdge h) {
            return surface.positions[surface.triangles[h / 3][static_cast<int>(h % 3)]];
        };
        const glm::dvec3 first = start(mesh.joins.complex[at]), second = start(next_side(mesh.joins.complex[at]));
        for (; at < end; ++at) {
            const HalfEdge h = mesh.joins.complex[at];
            const bool along = glm::distance(start(h), first) < glm::distance(start(h), second);
            balance += along != (changes.turned[mesh.joins.patches[h / 3]] != 0) ? 1 : -1;
        }
        if (balance != 0)
            return false;
    }
    return true;
}

// Whether the faces bound volumes and look out of them once they are turned. `flip`: all of them in the end.
bool is_closed(const Surface &surface, const Windings &mesh, const Changes &changes, bool flip) {
    const auto is_turned = [&](HalfEdge h) { return changes.turned[mesh.joins.patches[h / 3]]; };
    if (!mesh.joins.open.empty() || !mesh.cuts.empty() ||
        std::any_of(mesh.joins.against.begin(), mesh.joins.against.end(),
                    [&](const auto &sides) { return is_turned(sides[0]) == is_turned(sides[1]); }) ||
        !is_balanced(surface, mesh, changes))
        return false;
    std::vector<FaceSums> parts(mesh.parts);
    for (std::size_t patch = 0; patch < mesh.patches.size(); ++patch) {
        const WoundSheet &sheet = mesh.sheets[mesh.sheet_of[patch]];
        if (!sheet.is_cavity || flip)
            parts[sheet.part].add(mesh.patches[patch], (changes.turned[patch] != 0) != flip);
    }
    return std::all_of(parts.begin(), parts.end(), [](const FaceSums &part) {
        return part.volume >= -kVolumeRounding * part.area * std::sqrt(part.area);
    });
}

void turn(Surface &surface, const Windings &mesh, bool flip, Changes &changes) {
    if (std::find(changes.turned.begin(), changes.turned.end(), 1) != changes.turned.end()) {
        std::vector<std::uint8_t> faces(surface.triangles.size());
        for (std::size_t i = 0; i < faces.size(); ++i)
            faces[i] = changes.turned[mesh.joins.patches[i]];
        changes.faces = turn_faces(surface, faces);
    }
    if (flip)
        reverse_faces(surface);
}

// Makes given normals fit the faces. Returns whether they do.
bool reconcile_normals(Surface &surface, const Windings &mesh, bool flip, int threads, Changes &changes) {
    if (surface.normals.empty())
        return true;
    const bool turned = changes.faces.faces > 0 || flip;
    std::vector<FaceSums> sums = turned ? sum_patches(surface, mesh.joins, threads) : mesh.patches;
    if (changes.orients && !flip)
        turn_inward_normals(surface, mesh, sums, changes);
    if (changes.orients && changes.mixed > 0)
        remove_wrong_normals(surface, mesh, changes);
    if (changes.inward_normals + changes.removed_normals > 0)
        sums = sum_patches(surface, mesh.joins, threads);
    FaceSums all;
    for (const FaceSums &patch : sums)
        all.add(patch, false);
    return static_cast<double>(all.against) <= kFewContradictions * static_cast<double>(all.faces);
}

std::string turned_text(const Changes &changes) {
    std::string text = counted(changes.faces.faces, "face") + " turned";
    if (changes.faces.normals > 0)
        text += ", and " + counted(changes.faces.normals, "normal") + " with them";
    return text;
}

void report_request(const Surface &surface, const Changes &changes, int threads, BuildStatistics &statistics) {
    std::string note = changes.faces.faces == 0 ? "no face had to be turned" : turned_text(changes);
    if (changes.one_sided > 0)
        note += "; " + counted(changes.one_sided, "sheet") + " with one side only";
    if (faces_point_inward(surface, threads))
        note += "; most normals of the file look to the other side, and count";
    statistics.report("winding", changes.faces.faces == 0 ? Fate::kept : Fate::converted, note, surface.name);
}

void report_changes(const Surface &surface, const Changes &changes, BuildStatistics &statistics) {
    if (changes.faces.faces > 0) {
        std::string why;
        if (changes.inward > 0)
            why = counted(changes.inward, "closed sheet") + " looked inwards";
        if (changes.mixed > 0)
            why += (why.empty() ? "" : ", ") + counted(changes.mixed, "sheet") + " had two windings";
        statistics.report(Warning::turned_faces, "winding", why + ": " + turned_text(changes), surface.name);
    }
    if (changes.one_sided > 0)
        statistics.report(Warning::one_sided_sheets, "winding",
                          counted(changes.one_sided, "sheet") +
                              " with one side only: both sides are shown where two windings meet",
                          surface.name);
}

void report_normals(const Surface &surface, const Changes &changes, BuildStatistics &statistics) {
    std::string note;
    if (changes.inward_normals > 0)
        note = counted(changes.inward_normals, "normal") + " of closed sheets turned: most of them pointed inwards";
    if (changes.removed_normals > 0)
        note += (note.empty() ? "" : "; ") + counted(changes.removed_normals, "normal") +
                " against the faces replaced by those of the faces";
    if (!note.empty())
        statistics.report(Warning::turned_normals, "normals", note, surface.name);
}

// Reports faces without area, and faces that enclose a negative volume which is large for their area. With stations the
// winding is known, and an open scan of a room from within is wound like that.
void report_shape(const Surface &surface, const Windings &mesh, const Changes &changes, const WindingRequest &request,
                  BuildStatistics &statistics) {
    if (!surface.normals.empty())
        return;
    FaceSums all;
    for (std::size_t patch = 0; patch < mesh.patches.size(); ++patch)
        all.add(mesh.patches[patch], (changes.turned[patch] != 0) != request.flip);
    if (!(all.area > 0))
        statistics.report("faces", Fate::kept, "none of them has an area: the model is a line or a point");
    constexpr double kClearlyClosed = 0.01; // a sphere has 0.094
    if (!surface.stations.empty() || all.volume >= -kClearlyClosed * all.area * std::sqrt(all.area))
        return;
    const char *const remedy = request.flip ? "without --flip-faces" : "with --flip-faces";
    statistics.report(Warning::inward_faces, "winding",
                      std::string("the faces point inwards; if the model looks inside out, build it ") + remedy,
                      surface.name);
}

} // namespace

void wind_faces(Surface &surface, const WindingRequest &request, int threads, BuildStatistics &statistics) {
    surface.closed = false;
    if (surface.triangles.empty())
        return;
    if (surface.triangles.size() > kMaxMeshFaces) {
        if (request.flip)
            reverse_faces(surface);
        return;
    }
    const Windings mesh = find_windings(surface, threads);
    Changes changes = choose_changes(mesh, request);
    surface.closed = is_closed(surface, mesh, changes, request.flip);
    turn(surface, mesh, request.flip, changes);
    surface.closed &= reconcile_normals(surface, mesh, request.flip, threads, changes);
    show_both_sides(surface, mesh);
    if (request.requested)
        report_request(surface, changes, threads, statistics);
    else
        report_changes(surface, changes, statistics);
    report_normals(surface, changes, statistics);
    report_shape(surface, mesh, changes, request, statistics);
}

} // namespace pbm::build
