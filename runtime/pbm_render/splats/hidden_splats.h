// Finds splats of backs that nearer points hide, before they are projected. For files that Highway compiles for several
// targets: include it after highway.h, once per target.
#if defined(PBM_RENDER_HIDDEN_SPLATS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_HIDDEN_SPLATS_H
#undef PBM_RENDER_HIDDEN_SPLATS_H
#else
#define PBM_RENDER_HIDDEN_SPLATS_H
#endif

#include "pbm_render/splats/facing_points.h"
#include "pbm_render/splats/farthest_depths.h"

#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Whether all splats of a vector of backs from `first` on are hidden; may return false for such a vector. kBlock,
// kPlaced: as of find_facing_points.
template <int kBlock, bool kPlaced>
HWY_INLINE bool are_hidden(const StripRun &at, const FacingPoints &backs, std::size_t first, FarthestDepths &farthest) {
    constexpr bool kLarge = kBlock == 0;
    constexpr float kInset =
        kBackOutlineInset + (kPlaced ? (kLarge ? kPlacedOutlineInset + kFineInset : kPlacedBlockOutlineInset)
                                     : (kLarge ? kOutlineInset : kBlockOutlineInset));
    constexpr float kMaxInset = kPackedInsetMask / kPackedInsetScale + kGrazingInset;
    const FrameGeometry &frame = at.frame;
    const Floats d;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto load = [&](const auto &of) { return hn::Load(d, of.data() + first); };
    // Grid edges: from a point to the middle of its splat, from there to its border, and how much nearer it may be.
    const float ray_x = frame.middle_x * frame.inverse_focal, ray_y = frame.middle_y * frame.inverse_focal;
    const float stretch = std::sqrt(1 + ray_x * ray_x + ray_y * ray_y); // at the corners of the picture
    const Vector w = load(backs.w), pixels = hn::Div(set(frame.focal), w);
    const Vector offset = kPlaced ? hn::Abs(load(backs.offset)) : set(kMaxInset);
    const Vector moved = hn::Mul(hn::Add(kPlaced ? offset : hn::Zero(d), set(kInset)), set(stretch * at.run.voxel));
    Vector across = moved;
    if constexpr (kLarge)
        across = hn::Add(across, hn::Mul(load(backs.radius), set(stretch)));
    const Vector reach = hn::Add(hn::Mul(across, pixels), set(kBlock / 2.0F));
    const Vector steepest = set(2 * (kPlaced ? kPlacedSteepest : kSteepest));
    const Vector nearer =
        hn::Add(hn::Mul(hn::Div(reach, pixels), steepest), hn::Mul(offset, set(stretch * at.run.voxel)));
    const Mask is_point = hn::FirstN(d, backs.count - first);
    const auto least = [&](Vector v) { return hn::GetLane(hn::MinOfLanes(d, hn::IfThenElse(is_point, v, set(1e9F)))); };
    const auto most = [&](Vector v) { return hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElse(is_point, v, set(-1e9F)))); };
    const Vector x = load(backs.x), y = load(backs.y);
    const auto pixel = [](float v) { return static_cast<int>(v) - (v < 0); }; // never above the floor
    return farthest.hide({.left = pixel(least(hn::Sub(x, reach))),
                          .right = pixel(most(hn::Add(x, reach))) + 2,
                          .top = pixel(least(hn::Sub(y, reach))),
                          .bottom = pixel(most(hn::Add(y, reach))) + 2},
                         least(hn::Sub(w, nearer)));
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
