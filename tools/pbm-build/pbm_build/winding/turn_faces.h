// Reverses the winding of chosen faces, with their corners' attributes, and turns normals with their faces.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <span>

namespace pbm::build {

// What was turned.
struct TurnedFaces {
    std::uint64_t faces = 0, normals = 0; // counts
};

// Reverses the faces whose flag in `turn` is not 0; `turn` has one flag for each triangle. The normal of a vertex is
// turned if all of the vertex's faces are reversed and the normal pointed to their front before. A normal that pointed
// to their back stays: after the reversal that side is their front.
TurnedFaces turn_faces(Surface &surface, std::span<const std::uint8_t> turn);

} // namespace pbm::build
