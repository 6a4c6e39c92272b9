// Encodes a coloured triangle mesh as PLY.
#pragma once

#include "ply_text.h"

#include "pbm-sample/ammonite/ammonite.h"

#include "system/bytes.h"

#include <string>

namespace pbm::sample {

// Vertices are float x y z, uchar red green blue; faces list uchar int vertex_indices. `comment` is one line.
Bytes encode_ply(const TriangleMesh &mesh, PlyEncoding encoding, const std::string &comment);

} // namespace pbm::sample
