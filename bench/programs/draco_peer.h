// Draco's decoder, in a file of its own because of its headers.
#pragma once

#include "system/bytes.h"

namespace pbm::bench {

// Decodes a Draco point cloud and discards it. Returns its number of points, 0 if it is damaged.
std::uint64_t decode_draco(ByteView file);

} // namespace pbm::bench
