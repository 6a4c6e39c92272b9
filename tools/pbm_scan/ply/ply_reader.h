// Reads a PLY file in memory: ASCII and binary of both byte orders, every scalar type, lists anywhere, any order of
// elements and properties. Refuses a truncated or damaged file; never returns a partial surface.
// Based on: Turk. The PLY polygon file format. 1994
// Based on: Campbell. Point Based Modelling and Rendering. 2006 (element material)
#pragma once

#include "pbm_scan/surface/scan_format.h"
#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Reads (spellings in ply_roles.h): positions; normals (all zero: none); colours (ply_colours.h), else the mean of the
// colours of adjacent faces; splat radii; materials and their indices; polygons (polygon.h), triangle strips and range
// images (range_grid.h). Skips all other properties and reports them as dropped. Drops and counts non-finite vertices
// with their triangles.
//
// errors  bad_input            damaged or truncated, with `offset`; the message names line (ASCII) or byte (binary),
//                              row and property; with `strict` also a dropped attribute
//         too_large            over a limit of ply_header.h or ply_body.h
//         unsupported_version  a PLY version other than 1.0
Result<Surface> read_ply(const ScanFile &file, const ReadOptions &options);

// The images that the file names.
std::vector<NamedFile> files_of_ply(const ScanFile &file);

} // namespace pbm::build
