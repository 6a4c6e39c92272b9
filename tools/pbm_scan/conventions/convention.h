// What formats say of the coordinates of their scans: the axis that points up, and the unit.
#pragma once

#include "pbm_scan/conventions/crs.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <string_view>

namespace pbm::build {

// Sets `surface.convention`: by its CRS, else by the rule of the format (ScanFormat::name) or of files with this
// extension. Coordinates like those of a map have z up in every format. What a reader has set stays.
//
//   glTF                 y, m   a clear shape overrules the axis
//   E57, PTX, .pts       z, m
//   LAS, LAZ             z      the unit is that of the CRS
//   SPZ, Gaussian PLY    y      a clear shape overrules it
void apply_convention(std::string_view format, std::string_view extension, Surface &surface);

// Of a scan whose CRS is known.
void apply_crs(const CrsFacts &facts, Convention &convention);

// What all surfaces with positions say alike.
Convention common_convention(std::span<const Surface> surfaces);

} // namespace pbm::build
