// Verifies the signs of oriented normals: finds those that must be negated, and those that cannot be known.
// Based on: Zhu, Ghahramani, Lafferty. Semi-Supervised Learning Using Gaussian Fields and Harmonic Functions. 2003
// (known labels diffuse along links; here a link may also say "opposite", and points at a border have no label)
#pragma once

#include "pbm_build/normals/fit_planes.h"
#include "pbm_build/normals/outside_view.h"

namespace pbm::build {

using Vote = std::int16_t; // of a link, -kSure..kSure; positive: the normals of both ends point to the same side
inline constexpr int kSure = 255;

struct SignEvidence {
    std::vector<Vote> votes; // [points][kLinks], with PointLinks::nearest
    OutsideView view;        // [points], or empty: no point was seen from outside
    Bytes has_outside;       // [points] 1: the point's piece is mostly closed, so `view` tells its sign
    Bytes is_given;          // [points], or empty; 1: the sign is correct
};

enum class Verdict : std::int8_t { turn = -1, unknown = 0, keep = 1 };

// The confidence of a sign is the weighted mean of its neighbours' votes and of its visibility from outside. Votes that
// contradict each other, borders and curves give a low confidence: the sign is unknown. Points of low confidence divide
// a closed piece into parts, and each part is judged on its own: a part that is mostly hidden, or that is seen from
// both sides, is unknown, because it may be the wall of a cavity or a body within one. The same result for any number
// of threads.
std::vector<Verdict> reconsider_signs(const PlaneFits &fits, const SignEvidence &evidence, int threads);

} // namespace pbm::build
