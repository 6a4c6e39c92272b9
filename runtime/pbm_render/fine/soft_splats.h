// Splats of fine pictures: groups of soft ones, and their weights. For files that Highway compiles for several targets:
// include it after highway.h, once per target. Results are the same on every target.
#if defined(PBM_RENDER_SOFT_SPLATS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_SOFT_SPLATS_H
#undef PBM_RENDER_SOFT_SPLATS_H
#else
#define PBM_RENDER_SOFT_SPLATS_H
#endif

#include "pbm_render/fine/sampled_pixels.h"
#include "pbm_render/fine/splat_blender.h"
#include "pbm_render/splats/splat_projection.h"

#include <array>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Splats of a group: the same number on every target, so that all targets add in the same order.
inline constexpr std::size_t kGroupSplats = kMaxLanes;
// Of the splats whose nearest is the visible surface, and of those that are blended there.
inline constexpr Enlargement kSplats{.inset = kFineInset};
inline constexpr Enlargement kSoftSplats{.radius = kKernelRadius, .low_pass = kLowPass, .inset = kFineInset};

struct SplatGroup {
    Ellipses ellipses;
    alignas(64) std::array<float, kGroupSplats> across; // converts differences of depths to halves of kBlendBand
    std::int32_t columns, rows;                         // pixels of the largest box
};

// Computes a group of soft splats from `first` on. kWhole: as of project_ellipses.
template <bool kWhole>
HWY_NOINLINE void project_soft_splats(const StripRun &at, const FacingPoints &facing, std::size_t first,
                                      SplatGroup &to) {
    const Floats d;
    for (std::size_t i = 0; i < kGroupSplats; i += hn::Lanes(d)) {
        const ProjectedSplats splats =
            project_ellipses<true, kWhole>(at, facing, first + i, to.ellipses, i, kSoftSplats);
        const Vector band = hn::Mul(hn::Set(d, kBlendBand / 2), hn::LoadU(d, facing.radius.data() + first + i));
        hn::Store(hn::Div(hn::Max(splats.cosine, hn::Set(d, kBandCosine)), band), d, to.across.data() + i);
    }
}

// Which boxes of columns left .. right - 1 and rows top .. bottom - 1, within the strip, hold chosen pixels. An empty
// box may lie anywhere.
HWY_INLINE Mask hold_chosen(const ChosenCounts &chosen, IntVector left, IntVector right, IntVector top,
                            IntVector bottom) {
    const Floats d;
    const Ints di;
    const auto row = [&](IntVector y) {
        const IntVector from_top = hn::Max(hn::Sub(y, hn::Set(di, chosen.top())), hn::Zero(di));
        return hn::Mul(from_top, hn::Set(di, chosen.stride()));
    };
    const auto at = [&](IntVector y, IntVector x) { return hn::GatherIndex(di, chosen.above_left(), hn::Add(y, x)); };
    const IntVector upper = row(top), lower = row(bottom);
    const IntVector count =
        hn::Add(hn::Sub(at(lower, right), at(upper, right)), hn::Sub(at(upper, left), at(lower, left)));
    return hn::RebindMask(d, hn::Gt(count, hn::Zero(di)));
}

// The same for the boxes of a vector of ellipses: a bit for each.
HWY_INLINE unsigned find_chosen(const ChosenCounts &chosen, const Ellipses &e, std::size_t lane) {
    const Ints di;
    const auto load = [&](const auto &of) { return hn::Load(di, of.data() + lane); };
    return mask_bits(hold_chosen(chosen, load(e.left), load(e.right), load(e.top), load(e.bottom)));
}

// The weight of a splat at a pixel. `form`: the quadratic form there; `behind`: distance of the visible surface from
// the plane in halves of kBlendBand. The weight is 0 outside the splat and where there is no surface.
template <class D, class V = hn::Vec<D>> HWY_INLINE V blend_weight(D d, V form, V behind) {
    const auto zero = hn::Zero(d), one = hn::Set(d, 1);
    const V near = hn::Max(hn::Sub(hn::Set(d, 2), hn::Abs(behind)), zero), inside = hn::Max(hn::Sub(one, form), zero);
    return hn::Mul(hn::Mul(inside, inside), hn::Min(near, one));
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
