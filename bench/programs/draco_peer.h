// Draco's decoder, kept apart because of its headers.
#pragma once

#include "system/bytes.h"

namespace pbm::bench {

// Decodes a Draco point cloud, which is thrown away. Returns how many points came out, 0 if it is damaged.
std::uint64_t decode_draco(ByteView file);

} // namespace pbm::bench
