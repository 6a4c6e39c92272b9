// What time and the scanner left on the surface: detail finer than the lattice, and colour.
#pragma once

#include "shell.h"

#include <array>
#include <cstdint>

namespace pbm::sample {

struct FinishedVertex {
    Vec3 position;                       // shell space
    std::array<std::uint8_t, 3> color{}; // sRGB
};

// Finishes one vertex of the extracted surface. `normal` is a unit vector, `spacing` the distance of neighbouring
// vertices in shell units: detail below it fades into scanner noise, so that any density is rough in the way scans are.
// `index` numbers the vertex and selects its noise.
FinishedVertex finish_vertex(const Shell &shell, const Vec3 &position, const Vec3 &normal, double spacing,
                             std::uint32_t seed, std::uint64_t index);

} // namespace pbm::sample
