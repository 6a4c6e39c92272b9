// Round points: those of materials whose points lie on no surface (BVG.md 18). They are drawn as discs that face the
// eye.
// Stability: experimental.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_format/model/streams.h"

#include <cstdint>
#include <vector>

namespace pbm {

bool has_round_points(const ModelParameters &parameters);

// Normals and radii of points as they are drawn: round points have kRoundBit and kTwoSidedBit.
struct RoundPoints {
    static constexpr std::uint64_t kBytes = 3; // per point

    std::vector<std::uint16_t> normals;
    Bytes radii;
};

// Lets normals and radii of `points`, of one level, be those that are drawn, if some are round. `to` must outlive them.
void mark_round_points(PointView &points, const ModelParameters &parameters, int level, RoundPoints &to);

// The radius index that a round point of a node of `level` < `depth` is drawn with. The stored one covers all splats
// below the node (6.2.3), of which nothing is known but that they are at most so large: without the growth from level
// to level. A node with points beside each other is as wide as they are: at least kRoundCover edges of the node.
std::uint8_t drawn_radius(std::uint8_t stored, int level, int depth);

} // namespace pbm
