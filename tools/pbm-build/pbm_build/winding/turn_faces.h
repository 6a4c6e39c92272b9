// Turns faces around, with what belongs to them.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <span>

namespace pbm::build {

struct TurnedFaces {
    std::uint64_t faces = 0, normals = 0;
};

// `turn`: a flag for each triangle. The normal of a vertex is turned if all of its faces are, and if it agreed with
// them before. A normal that disagreed looks to the right side afterwards.
TurnedFaces turn_faces(Surface &surface, std::span<const std::uint8_t> turn);

} // namespace pbm::build
