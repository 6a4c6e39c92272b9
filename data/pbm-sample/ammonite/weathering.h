// Finishes the surface: detail finer than the lattice, scanner noise and colour.
#pragma once

#include "shell.h"

#include <array>
#include <cstdint>

namespace pbm::sample {

struct FinishedVertex {
    Vec3 position;                       // shell space
    std::array<std::uint8_t, 3> color{}; // sRGB
};

// Finishes one vertex of the extracted surface. `normal` is a unit vector; `spacing` is the distance of neighbouring
// vertices in shell units. Detail below it is replaced by scanner noise, so that every density is rough as scans are.
// `index` numbers the vertex and selects its noise.
FinishedVertex finish_vertex(const Shell &shell, const Vec3 &position, const Vec3 &normal, double spacing,
                             std::uint32_t seed, std::uint64_t index);

} // namespace pbm::sample
