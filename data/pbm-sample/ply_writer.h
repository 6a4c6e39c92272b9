// Writes a coloured triangle mesh as PLY.
#pragma once

#include "ammonite.h"

#include <string>
#include <system_error>

namespace pbm::sample {

enum class PlyEncoding { binary_little_endian, ascii };

// Vertices as float x y z, uchar red green blue; faces as list uchar int vertex_indices. `comment` is one line.
// The file appears complete or not at all: it is written beside `path` and renamed. "-" writes to standard output.
// Returns the system's error, or none.
std::error_code write_ply(const TriangleMesh &mesh, const std::string &path, PlyEncoding encoding,
                          const std::string &comment);

} // namespace pbm::sample
