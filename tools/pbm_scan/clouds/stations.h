// Where the scanner stood: the positions that estimated normals face (orient_normals.h).
#pragma once

#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Records that the scanner stood at `station`, in the same coordinates, for the positions from `first` on. Records
// nothing and returns false if the station is not finite, if there are too many stations, or if it is farther away than
// kMaxStationDistance diagonals of the positions' bounding box: in map coordinates the origin is no station.
inline constexpr double kMaxStationDistance = 50;
bool add_station(Surface &surface, std::size_t first, const glm::dvec3 &station);

// Fills `station_ids` for positions that have none yet.
void complete_station_ids(Surface &surface);

// Turns triangles towards the stations of their corners.
void face_stations(Surface &surface);

} // namespace pbm::build
