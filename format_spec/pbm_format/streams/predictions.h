// Predictions of radii and lit fractions of a child from its parent, for their filters. BVG.md 5.8.4 and 5.8.8
#pragma once

#include <array>
#include <cstdint>

namespace pbm {

// Largest radius index that a child at `level` can have below a node of radius index `parent`. BVG.md 5.8.4
const std::array<std::uint8_t, 256> &radius_predictions(int level, bool finest);

// Converts a lit fraction of `parent_bits` bits to `bits` bits. BVG.md 5.8.8
std::array<std::uint8_t, 256> shadow_predictions(unsigned parent_bits, unsigned bits);

} // namespace pbm
