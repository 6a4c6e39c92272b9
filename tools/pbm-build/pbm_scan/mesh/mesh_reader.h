// Reads OBJ, OFF and STL files in memory with OpenMesh, into plain arrays.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

enum class MeshFormat : std::uint8_t { obj, off, stl };

// mesh_text.h's checks run first; then OpenMesh reads in a child process (child_process.h), and what it found is
// compared with them, so that a damaged or cut-short file is refused instead of becoming a smaller model. An OBJ cut
// between two lines cannot be told from a whole one unless its comments announce counts; a text without a last line end
// is reported. Polygons: polygon.h. STL is welded by equal coordinates. Positions are in double precision where the
// file is text. Normals: OBJ's belong to corners; each vertex gets the mean of its own. No other file is opened.
//
// The child may use 20 s of computing and 2 s more per MB of the file, four times that on the clock, and 256 MB of
// memory and 24 bytes more per byte: 20 to 100 times what a whole file needs.
//
// errors  bad_input            damaged or cut short; OpenMesh crashed; with `strict` also anything that would be
// dropped
//         memory               OpenMesh came to a limit, or no child process can be had
//         too_large            over a limit of mesh_text.h
//         unsupported_feature  binary or four-dimensional OFF
Result<Surface> read_mesh(std::span<const std::uint8_t> bytes, MeshFormat format, const ReadOptions &options);

} // namespace pbm::build
