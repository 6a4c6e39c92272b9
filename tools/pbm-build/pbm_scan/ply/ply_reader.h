// Reads a PLY file in memory: ASCII, binary of both byte orders, every scalar type, lists anywhere, any order of
// elements and properties. Never a partial surface: what is cut short or damaged is refused.
// Based on: Turk. The PLY polygon file format. 1994
// Based on: Campbell. Point Based Modelling and Rendering. 2006 (element material)
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Understood (ply_roles.h has the spellings): positions; normals (all zero: none); colours (ply_colours.h), else the
// mean of the colours of the adjacent faces; splat radii; materials and their indices; polygons (polygon.h), triangle
// strips and range images (range_grid.h). Everything else is skipped by its size and reported as dropped. Vertices that
// are not finite are dropped with their triangles, and counted.
//
// errors  bad_input            damaged or cut short; `offset` is where, the message names line (ASCII) or byte
// (binary),
//                              element, row and property; with `strict` also anything that would be dropped
//         too_large            over a limit of ply_header.h or ply_body.h
//         unsupported_version  a PLY version other than 1.0
Result<Surface> read_ply(std::span<const std::uint8_t> bytes, const ReadOptions &options);

} // namespace pbm::build
