// Encodes a coloured triangle mesh as PLY.
#pragma once

#include "ammonite.h"

#include "system/bytes.h"

#include <string>

namespace pbm::sample {

enum class PlyEncoding { binary_little_endian, ascii };

// Returns the whole file: vertices as float x y z, uchar red green blue; faces as list uchar int vertex_indices.
// `comment` is one line.
Bytes encode_ply(const TriangleMesh &mesh, PlyEncoding encoding, const std::string &comment);

} // namespace pbm::sample
