// Reads PCD files of the Point Cloud Library: versions .5 to .7, ASCII, binary and compressed.
// Based on: Rusu, Cousins. 3D is here: Point Cloud Library. 2011 (its file format)
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Positions, normals, colours (three fields, or one packed as float or integer) and intensity. The translation of
// VIEWPOINT is where the scanner stood, unless it is 0 0 0; its rotation is not applied: writers store points in the
// coordinates of the cloud. Points without finite coordinates are missing returns of an image: left out, and counted.
//
// errors  bad_input  damaged or cut short; no x, y, z; with `strict` a dropped field
Result<Surface> read_pcd(std::span<const std::uint8_t> bytes, const ReadOptions &options);
bool is_pcd(std::span<const std::uint8_t> bytes);

} // namespace pbm::build
