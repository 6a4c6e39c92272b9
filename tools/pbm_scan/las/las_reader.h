// Reads LAS and LAZ files: versions 1.0 to 1.5, point formats 0 to 10.
// Based on: ASPRS. LAS Specification 1.4 - R15. 2019
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Positions in doubles (record x scale + offset), colours, else the intensity as grey, and the coordinate reference
// system (WKT, or GeoTIFF keys as a text). Points flagged as withheld are left out and counted. The points that are
// there count: where the header announces others, or other bounds, the report says so.
//
// errors  bad_input            damaged or cut short; with `strict` a dropped field
//         unsupported_feature  a kind of LAZ that is not known (laz_layout.h)
Result<Surface> read_las(std::span<const std::uint8_t> bytes, const ReadOptions &options);
bool is_las(std::span<const std::uint8_t> bytes);

} // namespace pbm::build
