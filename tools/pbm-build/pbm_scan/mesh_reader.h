// Reads OBJ, OFF and STL files in memory with OpenMesh, into plain arrays.
#pragma once

#include "pbm_scan/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

enum class MeshFormat : std::uint8_t { obj, off, stl };

// mesh_text.h's checks run first, and what OpenMesh found is compared with them, so that a damaged or cut-short file is
// refused instead of becoming a smaller model (a text file cut between two lines of an OBJ cannot be told from a whole
// one). Polygons are fanned. STL is welded by equal coordinates. Positions of OBJ and OFF are in double precision.
// Normals: OBJ's belong to corners; each vertex gets the mean of its own. No other file is opened.
// OpenMesh's readers are singletons: calls wait for each other.
//
// errors  bad_input            damaged or cut short; with `strict` also anything that would be dropped
//         too_large            over a limit of mesh_text.h
//         unsupported_feature  binary or four-dimensional OFF
Result<Surface> read_mesh(std::span<const std::uint8_t> bytes, MeshFormat format, const ReadOptions &options);

} // namespace pbm::build
