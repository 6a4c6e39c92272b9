// Reads OBJ, OFF and STL files in memory with OpenMesh, into plain arrays.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

enum class MeshFormat : std::uint8_t { obj, off, stl };

// Runs the checks of mesh_text.h, then OpenMesh in a child process (child_process.h), and compares the two results, so
// that a damaged or truncated file is refused instead of becoming a smaller model. An OBJ truncated between two lines
// is detected only if its comments announce counts; a missing last line end is reported. Polygons: polygon.h. STL is
// welded by equal coordinates. Positions of text files are in double precision. A vertex whose
// corners have different normals becomes several. Opens no other file.
//
// Limits of the child: 20 s of processor time and 2 s more per MB of the file, four times that in wall time; 256 MB of
// memory and 24 bytes more per byte of the file. A valid file needs a twentieth to a hundredth of that.
//
// errors  bad_input            damaged or truncated; OpenMesh crashed; with `strict` also a dropped attribute
//         memory               OpenMesh reached a limit, or no child process could be started
//         too_large            over a limit of mesh_text.h
//         unsupported_feature  binary or four-dimensional OFF
Result<Surface> read_mesh(std::span<const std::uint8_t> bytes, MeshFormat format, const ReadOptions &options);

} // namespace pbm::build
