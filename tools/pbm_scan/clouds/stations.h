// Where the scanner stood: the positions that estimated normals face (orient_normals.h).
#pragma once

#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Says that the positions from `first` on were seen from `station`, in their coordinates. Returns false, and says so of
// none of them, where this cannot be so: the station is farther away than kMaxStationDistance diagonals of their box,
// as the origin is from a scan in the coordinates of a map; or it is not finite; or there are too many stations.
inline constexpr double kMaxStationDistance = 50;
bool add_station(Surface &surface, std::size_t first, const glm::dvec3 &station);

// Fills `station_ids` for positions that have none yet.
void complete_station_ids(Surface &surface);

// Turns triangles towards the stations of their corners.
void face_stations(Surface &surface);

} // namespace pbm::build
