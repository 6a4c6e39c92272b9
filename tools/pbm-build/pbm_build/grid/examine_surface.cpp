#include "pbm_build/grid/examine_surface.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace pbm::build {
namespace {

Status check_surface(const Surface &surface) {
    if (surface.positions.empty())
        return Error{ErrorCode::bad_input, 0, "the file has no points: there is nothing to build"};
    if (surface.triangles.empty() && surface.dropped_triangles > 0 && surface.normals.empty())
        return Error{ErrorCode::bad_input, 0,
                     "no face is left: " + std::to_string(surface.dropped_triangles) +
                         (surface.dropped_triangles == 1 ? " is degenerate or has" : " are degenerate or have") +
                         " a corner that is not finite; mend the scan"};
    if (surface.materials.size() > kMaxMaterials)
        return Error{ErrorCode::unsupported_feature, 0,
                     std::to_string(surface.materials.size()) + " materials, a .pbvg file holds " +
                         std::to_string(kMaxMaterials) + "; merge some of them"};
    return {};
}

// What the readers left out.
void report_dropped(const Surface &surface, BuildStatistics &statistics) {
    const auto report = [&](const char *name, std::uint64_t count, const char *why) {
        if (count > 0)
            statistics.attributes.push_back(
                {name, AttributeReport::Fate::dropped, std::to_string(count) + std::string(why), surface.name});
    };
    report("vertices", surface.dropped_vertices, " with coordinates that are not finite");
    report("triangles", surface.dropped_triangles, " degenerate, or with a dropped vertex");
}

// Says when the faces have no area, or enclose a negative volume that is large for it. Rooms scanned from within do so
// rightly, so nothing is turned unasked.
void report_winding(const Surface &surface, BuildStatistics &statistics) {
    if (surface.triangles.empty() || !surface.normals.empty())
        return;
    constexpr double kClearlyClosed = 0.01; // a sphere has 0.094
    double volume = 0, area = 0;
    const glm::dvec3 &origin = surface.positions.front();
    for (const glm::uvec3 &t : surface.triangles) {
        const glm::dvec3 a = surface.positions[t.x] - origin, b = surface.positions[t.y] - origin,
                         c = surface.positions[t.z] - origin;
        volume += glm::dot(a, glm::cross(b, c)) / 6;
        area += glm::length(glm::cross(b - a, c - a)) / 2;
    }
    if (!(area > 0))
        statistics.attributes.push_back(
            {"faces", AttributeReport::Fate::kept, "none of them has an area: the model is a line or a point"});
    if (volume < -kClearlyClosed * area * std::sqrt(area))
        statistics.attributes.push_back(
            {"winding", AttributeReport::Fate::kept,
             "the faces point inwards; if the model looks inside out, build it with --flip-faces", surface.name});
}

// Vertices that no triangle uses have no surface to belong to.
Status report_loose_vertices(const Surface &surface, bool strict, BuildStatistics &statistics) {
    if (surface.triangles.empty())
        return {};
    std::vector<bool> used(surface.positions.size(), false);
    for (const glm::uvec3 &t : surface.triangles)
        used[t.x] = used[t.y] = used[t.z] = true;
    const auto loose = std::count(used.begin(), used.end(), false);
    if (loose == 0)
        return {};
    const std::string note =
        std::to_string(loose) + (loose == 1 ? " vertex belongs" : " vertices belong") + " to no face";
    if (strict)
        return Error{ErrorCode::bad_input, 0,
                     "--strict: " + note + "; remove them from the scan or leave --strict out"};
    statistics.attributes.push_back({"loose vertices", AttributeReport::Fate::dropped, note, surface.name});
    return {};
}

} // namespace

Status examine_surface(Surface &surface, bool flip_faces, bool strict, BuildStatistics &statistics) {
    statistics.vertices += surface.positions.size();
    statistics.triangles += surface.triangles.size();
    statistics.input_bytes += surface.input_bytes;
    for (AttributeReport &line : surface.report)
        line.input = surface.name;
    statistics.attributes.insert(statistics.attributes.end(), surface.report.begin(), surface.report.end());
    surface.report.clear();
    report_dropped(surface, statistics);
    if (flip_faces)
        for (glm::uvec3 &t : surface.triangles)
            std::swap(t.y, t.z);
    if (flip_faces && surface.triangles.empty())
        statistics.attributes.push_back(
            {"--flip-faces", AttributeReport::Fate::dropped, "there are no faces", surface.name});
    report_winding(surface, statistics);
    if (Status checked = check_surface(surface); !checked)
        return checked;
    return report_loose_vertices(surface, strict, statistics);
}

void report_steps(std::span<const SinglePrecision> inputs, double voxel_size, BuildStatistics &statistics) {
    for (const SinglePrecision &input : inputs)
        if (input.step > voxel_size) {
            std::array<char, 256> note{};
            std::snprintf(note.data(), note.size(),
                          "single precision: near %.3g they have steps of %.3g, a voxel has %.3g; export the scan with "
                          "doubles, or shifted to its place, and give the shift as --origin",
                          input.near, input.step, voxel_size);
            statistics.attributes.push_back({"coordinates", AttributeReport::Fate::kept, note.data(), input.input});
        }
}

void report_precision(const Bounds &bounds, const Grid &grid, BuildStatistics &statistics) {
    const double extent = bounds.extent();
    if (!(extent > 0) || grid.edge() <= 2 * extent)
        return;
    std::array<char, 200> note{};
    std::snprintf(note.data(), note.size(),
                  "the scan is %.3g long and lies %.3g from the origin: its grid is %.3g long, finer voxels would be "
                  "below the precision of coordinates; move the scan to its origin",
                  extent, farthest_coordinate(bounds), grid.edge());
    statistics.attributes.push_back({"precision", AttributeReport::Fate::converted, note.data()});
}

} // namespace pbm::build
