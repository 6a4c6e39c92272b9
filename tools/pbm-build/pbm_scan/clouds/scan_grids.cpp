#include "pbm_scan/clouds/scan_grids.h"

#include "pbm_scan/clouds/stations.h"
#include "pbm_scan/surface/range_grid.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr const char *kName = "rows and columns";

// The station of the grid's points, or null.
const glm::dvec3 *station_of(const Surface &surface, const ScanGrid &grid) {
    const auto cell = std::find_if(grid.cells.begin(), grid.cells.end(), [](auto c) { return c != kEmptyCell; });
    if (cell == grid.cells.end() || surface.station_ids.empty() || surface.station_ids[*cell] == kNoStation)
        return nullptr;
    return &surface.stations[surface.station_ids[*cell]];
}

std::size_t positions_in_triangles(const Surface &surface) {
    std::vector<bool> used(surface.positions.size());
    for (const glm::uvec3 &t : surface.triangles)
        used[t.x] = used[t.y] = used[t.z] = true;
    return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
}

} // namespace

AttributeReport triangulate_scans(Surface &surface, const std::vector<ScanGrid> &grids) {
    const auto stay_points = [&surface](const std::string &why) {
        surface.triangles = {};
        return AttributeReport{kName, Fate::dropped, why + ": the scans are kept as points"};
    };
    for (const ScanGrid &grid : grids) {
        const glm::dvec3 *const station = station_of(surface, grid);
        if (grid.columns == 0)
            return stay_points("not every scan has one point at each");
        if (station == nullptr)
            return stay_points("the scanner's position is not known");
        const std::vector<glm::uvec3> triangles =
            triangulate_range_grid(grid.cells, grid.columns, surface.positions, station);
        surface.triangles.insert(surface.triangles.end(), triangles.begin(), triangles.end());
    }
    const std::size_t all = surface.positions.size(), used = positions_in_triangles(surface);
    if (static_cast<double>(used) < kMinTriangulatedShare * static_cast<double>(all))
        return stay_points("steps in depth of more than 4 grid steps would leave " + std::to_string(all - used) +
                           " of " + std::to_string(all) + " points without a triangle");
    face_stations(surface);
    return {kName, Fate::converted,
            "to triangles; steps in depth of more than 4 grid steps stay open, with " + std::to_string(all - used) +
                " points"};
}

} // namespace pbm::build
