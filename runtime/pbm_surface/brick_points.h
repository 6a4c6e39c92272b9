// Sizes of arrays that hold the points of a brick.
#pragma once

#include <cstddef>

namespace pbm {

inline constexpr std::size_t kBrickPoints = 512;
inline constexpr std::size_t kMaxLanes = 16; // of a SIMD vector

} // namespace pbm
