#include "pbm_build/preparing/examine_surface.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

Status check_surface(const Surface &surface) {
    if (surface.triangles.empty() && surface.dropped_triangles > 0 && surface.normals.empty())
        return bad_input("no face is left: " + std::to_string(surface.dropped_triangles) +
                         (surface.dropped_triangles == 1 ? " is degenerate or has" : " are degenerate or have") +
                         " a corner that is not finite; repair the scan");
    if (surface.materials.size() > kMaxMaterials)
        return unsupported(std::to_string(surface.materials.size()) + " materials, a .pbvg file holds " +
                           std::to_string(kMaxMaterials) + "; merge some of them");
    return {};
}

// Reports what the readers dropped.
void report_dropped(const Surface &surface, BuildStatistics &statistics) {
    const auto report = [&](const char *name, std::uint64_t count, const char *why) {
        if (count > 0)
            statistics.report(Warning::unusable_geometry, name, std::to_string(count) + why, surface.name);
    };
    report("vertices", surface.dropped_vertices, " with coordinates that are not finite");
    report("triangles", surface.dropped_triangles, " degenerate, or with a dropped vertex");
}

// Reports vertices without a triangle, which are dropped; refuses them with `strict`.
Status report_loose_vertices(const Surface &surface, bool strict, BuildStatistics &statistics) {
    if (surface.triangles.empty())
        return {};
    std::vector<bool> used(surface.positions.size(), false);
    for (const glm::uvec3 &t : surface.triangles)
        used[t.x] = used[t.y] = used[t.z] = true;
    const auto loose =
        std::count(used.begin(), used.begin() + static_cast<std::ptrdiff_t>(surface.first_point()), false);
    if (loose == 0)
        return {};
    const std::string note =
        std::to_string(loose) + (loose == 1 ? " vertex belongs" : " vertices belong") + " to no face";
    if (strict)
        return bad_input("--strict: " + note + "; remove them from the scan or leave --strict out");
    statistics.report(Warning::loose_vertices, "loose vertices", note, surface.name);
    return {};
}

} // namespace

void take_report(Surface &surface, BuildStatistics &statistics) {
    statistics.vertices +=
        surface.positions.size() - std::min<std::uint64_t>(surface.vertex_copies, surface.positions.size());
    statistics.triangles += surface.triangles.size();
    statistics.input_bytes += surface.input_bytes;
    for (AttributeReport &line : surface.report)
        line.input = surface.name;
    statistics.attributes.insert(statistics.attributes.end(), surface.report.begin(), surface.report.end());
    surface.report.clear();
    report_dropped(surface, statistics);
}

Status examine_surface(const Surface &surface, bool strict, BuildStatistics &statistics) {
    if (Status checked = check_surface(surface); !checked)
        return checked;
    return report_loose_vertices(surface, strict, statistics);
}

void report_steps(std::span<const SinglePrecision> inputs, double voxel_size, BuildStatistics &statistics) {
    for (const SinglePrecision &input : inputs)
        if (input.step > voxel_size)
            statistics.report(
                Warning::coordinate_steps, "coordinates",
                formatted("near %.3g they have the steps of single precision, %.3g, and a voxel has %.3g; export the "
                          "scan with more digits (doubles), or shifted to its place, and give the shift as --origin",
                          input.near, input.step, voxel_size),
                input.input);
}

void report_precision(const Bounds &bounds, const Grid &grid, BuildStatistics &statistics) {
    const double extent = bounds.extent();
    if (!(extent > 0) || grid.edge() <= 2 * extent)
        return;
    statistics.report(
        Warning::far_coordinates, "precision",
        formatted("the scan is %.3g long and lies %.3g from the origin: its grid is %.3g long, finer voxels would be "
                  "below the precision of coordinates; move the scan to its origin",
                  extent, farthest_coordinate(bounds), grid.edge()));
}

} // namespace pbm::build
