// Points that are drawn otherwise than the file has them, marked by bits of their normals: round points, those of
// materials whose points lie on no surface (BVG.md 18), are discs that face the eye; hidden points are not drawn.
// Stability: experimental.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_format/model/streams.h"
#include "pbm_render/appearance/hidden_classes.h"

#include <cstdint>
#include <vector>

namespace pbm {

bool has_round_points(const ModelParameters &parameters);

// Normals and radii of points as they are drawn: round points have kRoundBit and kTwoSidedBit, hidden ones kHiddenBits.
struct MarkedPoints {
    std::vector<std::uint16_t> normals;
    Bytes radii;
};
inline constexpr std::uint64_t kRoundPointBytes = 3, kHiddenPointBytes = 2; // of that, per point of a chunk

// Lets normals and radii of `points`, of one level, be those that are drawn, if some are round. `to` must outlive them.
void mark_round_points(PointView &points, const ModelParameters &parameters, int level, MarkedPoints &to);

// The same for hidden points, after round ones. `classes`: stored values of the points. Returns whether there are any.
bool mark_hidden_points(PointView &points, const HiddenClasses &hidden, ByteView classes, MarkedPoints &to);

// Marks the hidden points of a whole model whose fields are loaded, for renderers of models.
void hide_points(Model &model, const HiddenClasses &hidden);

// The radius index that a round point of a node of `level` < `depth` is drawn with. The stored one covers all splats
// below the node (6.2.3), of which nothing is known but that they are at most so large: without the growth from level
// to level. A node with points beside each other is as wide as they are: at least kRoundCover edges of the node.
std::uint8_t drawn_radius(std::uint8_t stored, int level, int depth);

} // namespace pbm
