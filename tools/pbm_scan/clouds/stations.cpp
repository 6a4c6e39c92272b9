#include "pbm_scan/clouds/stations.h"

#include <glm/geometric.hpp>

namespace pbm::build {

bool add_station(Surface &surface, std::size_t first, const glm::dvec3 &station) {
    glm::dvec3 lowest(std::numeric_limits<double>::infinity()), highest(-lowest);
    for (std::size_t i = first; i < surface.positions.size(); ++i)
        if (const glm::dvec3 &p = surface.positions[i]; is_finite(p)) {
            lowest = glm::min(lowest, p);
            highest = glm::max(highest, p);
        }
    const double distance = glm::distance(station, glm::clamp(station, lowest, highest));
    if (!(distance <= kMaxStationDistance * glm::distance(lowest, highest)) || surface.stations.size() == kNoStation)
        return false;
    surface.station_ids.resize(first, kNoStation);
    surface.station_ids.resize(surface.positions.size(), static_cast<std::uint16_t>(surface.stations.size()));
    surface.stations.push_back(station);
    return true;
}

void complete_station_ids(Surface &surface) {
    if (!surface.stations.empty())
        surface.station_ids.resize(surface.positions.size(), kNoStation);
}

void face_stations(Surface &surface) {
    for (glm::uvec3 &t : surface.triangles) {
        const std::uint16_t station = surface.station_ids.empty() ? kNoStation : surface.station_ids[t.x];
        if (station == kNoStation)
            continue;
        const glm::dvec3 &a = surface.positions[t.x];
        const glm::dvec3 normal = glm::cross(surface.positions[t.y] - a, surface.positions[t.z] - a);
        if (glm::dot(normal, surface.stations[station] - a) < 0)
            std::swap(t.y, t.z);
    }
}

} // namespace pbm::build
