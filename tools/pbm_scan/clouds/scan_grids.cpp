#include "pbm_scan/clouds/scan_grids.h"

#include "pbm_scan/clouds/stations.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/text/printable.h"
#include "system/free_memory.h"

#include <algorithm>
#include <numeric>
#include <utility>

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

// Moves the positions without a triangle behind the others, as points.
void put_points_last(Surface &surface) {
    std::vector<bool> used(surface.positions.size());
    for (const glm::uvec3 &t : surface.triangles)
        used[t.x] = used[t.y] = used[t.z] = true;
    std::vector<std::uint32_t> order(used.size()), new_index(used.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto points = std::stable_partition(order.begin(), order.end(), [&](std::uint32_t i) { return used[i]; });
    surface.points_beside_triangles = static_cast<std::size_t>(order.end() - points);
    for (std::uint32_t i = 0; i < order.size(); ++i)
        new_index[order[i]] = i;
    const auto reorder = [&](auto &values) {
        auto old = std::exchange(values, {});
        values.reserve(old.size());
        for (std::size_t i = 0; i < old.size(); ++i)
            values.push_back(old[order[i]]);
    };
    reorder(surface.positions);
    for_vertex_attributes(reorder, surface);
    for (glm::uvec3 &t : surface.triangles)
        t = {new_index[t.x], new_index[t.y], new_index[t.z]};
}

} // namespace

AttributeReport triangulate_scans(Surface &surface, const std::vector<ScanGrid> &grids) {
    const auto stay_points = [&surface](const std::string &why) {
        free_memory(surface.triangles);
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
    put_points_last(surface);
    const std::size_t all = surface.positions.size(), points = surface.points_beside_triangles;
    if (static_cast<double>(all - points) < kMinTriangulatedShare * static_cast<double>(all)) {
        surface.points_beside_triangles = 0;
        return stay_points("steps in depth of more than 4 grid steps leave " + std::to_string(points) + " of " +
                           std::to_string(all) + " points without a triangle");
    }
    face_stations(surface);
    return {kName, Fate::converted,
            "to triangles; at steps in depth of more than 4 grid steps " + counted(points, "point") + " stay points"};
}

} // namespace pbm::build
