// Reads Gaussian splats of Niantic's SPZ, versions 1 to 4, as points.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Whether the bytes begin as an SPZ does that is not, or no longer, compressed as a whole (surface_reader.h unpacks).
bool is_spz(std::span<const std::uint8_t> bytes);

// The centres of the splats and their mean colours. The opacity can be a field. Coordinates are kept: x right, y up,
// z backwards. Shape and harmonics are dropped.
// Based on: Niantic. spz. https://github.com/nianticlabs/spz
//
// errors  bad_input            cut short, damaged, or no splats
//         unsupported_version  a version above 4
//         memory               splats of version 4 that are packed more than 200 times
Result<Surface> read_spz(std::span<const std::uint8_t> bytes, const ReadOptions &options);

} // namespace pbm::build
