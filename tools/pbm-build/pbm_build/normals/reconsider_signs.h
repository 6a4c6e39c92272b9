// Second thoughts about the signs of oriented normals: which should be turned, and which nobody knows.
// Based on: Zhu, Ghahramani, Lafferty. Semi-Supervised Learning Using Gaussian Fields and Harmonic Functions. 2003
// (what
//           is known spreads along links; here links may also say "opposite", and borders of a surface know nothing)
#pragma once

#include "pbm_build/normals/fit_planes.h"
#include "pbm_build/normals/outside_view.h"

namespace pbm::build {

using Vote = std::int16_t; // of a link, -kSure..kSure; positive: the normals of both ends point to one side as they are
inline constexpr int kSure = 255;

struct SignEvidence {
    std::vector<Vote> votes; // [points][kLinks], with PointLinks::nearest
    OutsideView view;        // [points], or empty: nothing is known of outsides
    Bytes has_outside; // [points] 1: belongs to a piece that is closed by and large, so that `view` tells its sign
    Bytes is_given;    // [points], or empty; 1: the sign is right
};

enum class Verdict : std::int8_t { turn = -1, unknown = 0, keep = 1 };

// Each normal is as sure as its neighbours and what is seen of it say together; where they contradict each other, or
// where the points are no samples of a surface but border or curves, nothing is sure. The parts of a closed piece that
// doubt separates are judged each by itself: one that is mostly hidden, or seen from both sides, is unknown too, since
// it may be a wall of a cavity as well as a body in it. The same for any number of threads.
std::vector<Verdict> reconsider_signs(const PlaneFits &fits, const SignEvidence &evidence, int threads);

} // namespace pbm::build
