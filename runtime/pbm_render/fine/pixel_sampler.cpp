#include "pbm_render/fine/pixel_sampler.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/fine/pixel_sampler.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/fine/soft_splats.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A splat of a group at a pixel: its form and depth, computed for a vector of samples.
class SplatAtPixel {
  public:
    HWY_INLINE SplatAtPixel(const Ellipses &ellipses, std::size_t lane, int x, int y)
        : e_(ellipses), lane_(lane), x_(static_cast<float>(x) + 0.5F - e_.x[lane]),
          y_(static_cast<float>(y) + 0.5F - e_.y[lane]) {}

    // Lower bound of the depths of the samples.
    HWY_INLINE float nearest() const {
        const float slope_x = e_.slope_x[lane_], slope_y = e_.slope_y[lane_];
        constexpr float kHalf = 0.51F; // a pixel, and rounding
        return e_.depth[lane_] + slope_x * x_ + slope_y * y_ - kHalf * (std::abs(slope_x) + std::abs(slope_y));
    }
    // `d`: of the vectors; `offset_x`, `offset_y`: those of its samples.
    template <class D, class V = hn::Vec<D>>
    HWY_INLINE void look(D d, const float *offset_x, const float *offset_y, V &form, V &depth) const {
        const auto set = [&](float value) { return hn::Set(d, value); };
        const V x = hn::Add(set(x_), hn::LoadU(d, offset_x)), y = hn::Add(set(y_), hn::LoadU(d, offset_y));
        form = hn::Add(hn::Mul(x, hn::Add(hn::Mul(set(e_.xx[lane_]), x), hn::Mul(set(e_.xy[lane_]), y))),
                       hn::Mul(hn::Mul(set(e_.yy[lane_]), y), y));
        depth = hn::Add(hn::Add(set(e_.depth[lane_]), hn::Mul(set(e_.slope_y[lane_]), y)),
                        hn::Mul(set(e_.slope_x[lane_]), x));
    }

  private:
    const Ellipses &e_;
    std::size_t lane_;
    float x_, y_;
};

// Draws a splat into the samples of a pixel, as draw_ellipse does into pixels.
HWY_INLINE void draw_pixel(const SplatAtPixel &splat, float cone, std::uint32_t id,
                           const SampledPixels::Offsets &offsets, double *samples) {
#if HWY_TARGET == HWY_SCALAR
    const hn::CappedTag<float, 1> d;
    for (std::size_t i = 0; i < SampledPixels::kSamples; ++i) {
        auto form = hn::Zero(d), depth = form;
        splat.look(d, offsets.x.data() + i, offsets.y.data() + i, form, depth);
        if (hn::GetLane(form) <= 1)
            samples[i] = std::min(samples[i], DepthStrip::pixel(hn::GetLane(depth) + cone * hn::GetLane(form), id));
    }
#else
    const hn::FixedTag<float, 4> d32;
    const hn::FixedTag<std::uint32_t, 4> du32;
    const hn::FixedTag<double, 2> d64;
    const auto ids = hn::Set(du32, id);
    for (std::size_t i = 0; i < SampledPixels::kSamples; i += 4) {
        auto form = hn::Zero(d32), depth = form;
        splat.look(d32, offsets.x.data() + i, offsets.y.data() + i, form, depth);
        depth = hn::Add(depth, hn::Mul(hn::Set(d32, cone), form));
        const auto z = hn::BitCast(du32, hn::IfThenElse(hn::Le(form, hn::Set(d32, 1)), depth,
                                                        hn::Set(d32, std::numeric_limits<float>::infinity())));
        const auto draw = [&](auto value, double *to) {
            hn::StoreU(lesser_doubles(hn::BitCast(d64, value), hn::LoadU(d64, to)), d64, to);
        };
        draw(hn::InterleaveLower(du32, ids, z), samples + i);
        draw(hn::InterleaveUpper(du32, ids, z), samples + i + 2);
    }
#endif
}

void draw_samples(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SampledPixels::Offsets &offsets, const float *hiding, SampledPixels &pixels) {
    Ellipses e;
    const std::size_t lanes = hn::Lanes(Floats());
    for (const std::unique_ptr<StripPoints::Block> &block : points.blocks()) {
        const StripRun at{frame, *block->run, strip};
        const FacingPoints &facing = block->points;
        const float cone = kPlacedCone * at.run.voxel;
        for (std::size_t i = 0; i < facing.count; i += lanes) {
            project_ellipses<true, true>(at, facing, i, e, 0, kSplats);
            for (unsigned some = find_chosen(*pixels.strip, e, 0); some != 0; some &= some - 1) {
                const auto lane = static_cast<std::size_t>(std::countr_zero(some));
                const auto id = static_cast<std::uint32_t>(facing.id[i + lane]);
                pixels.for_each_in_box(e.left[lane], e.right[lane], e.top[lane], e.bottom[lane],
                                       [&](int x, int y, std::size_t pixel) {
                                           const SplatAtPixel splat(e, lane, x, y);
                                           if (hiding == nullptr || splat.nearest() <= hiding[pixel])
                                               draw_pixel(splat, cone, id, offsets,
                                                          pixels.visible.data() + pixel * SampledPixels::kSamples);
                                       });
            }
        }
    }
}

using Samples = hn::CappedTag<float, SampledPixels::kSamples>;

// Computes the weights of a splat at the samples of a pixel. Returns whether one is above 0.
HWY_INLINE bool weigh_samples(const SplatAtPixel &splat, float across, const SampledPixels::Offsets &offsets,
                              const float *depths, float *weights) {
    const Samples d;
    auto largest = hn::Zero(d);
    for (std::size_t i = 0; i < SampledPixels::kSamples; i += hn::Lanes(d)) {
        auto form = hn::Zero(d), depth = form;
        splat.look(d, offsets.x.data() + i, offsets.y.data() + i, form, depth);
        const auto behind = hn::Mul(hn::Sub(depth, hn::LoadU(d, depths + i)), hn::Set(d, across));
        const auto weight = blend_weight(d, form, behind);
        hn::StoreU(weight, d, weights + i);
        largest = hn::Max(largest, weight);
    }
    return !hn::AllFalse(d, hn::Gt(largest, hn::Zero(d)));
}

template <std::size_t kGroups>
HWY_INLINE void add_to_samples(const SurfacePoint &point, const float *weights, SurfaceGroup *sums) {
    const Samples d;
    for (std::size_t i = 0; i < SampledPixels::kSamples; i += hn::Lanes(d)) {
        const auto weight = hn::LoadU(d, weights + i);
        for (std::size_t channel = 0; channel < kGroups * kGroupChannels; ++channel) {
            float *const to = sums[channel].channels.data() + i;
            hn::StoreU(hn::Add(hn::LoadU(d, to), hn::Mul(weight, hn::Set(d, point.channels[channel]))), d, to);
        }
    }
}

template <std::size_t kGroups>
void blend_groups(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SurfacePoints &looks, const SampledPixels::Offsets &offsets, const BlendedSide &side,
                  SampledPixels &pixels) {
    SplatGroup group;
    const Ellipses &e = group.ellipses;
    for (const std::unique_ptr<StripPoints::Block> &block : points.blocks()) {
        const StripRun at{frame, *block->run, strip};
        const FacingPoints &facing = block->points;
        for (std::size_t i = 0; i < facing.count; i += kGroupSplats) {
            project_soft_splats<true>(at, facing, i, group);
            unsigned some = 0;
            for (std::size_t lane = 0; lane < kGroupSplats; lane += hn::Lanes(Floats()))
                some |= find_chosen(*pixels.strip, e, lane) << lane;
            for (; some != 0; some &= some - 1) {
                const auto lane = static_cast<std::size_t>(std::countr_zero(some));
                const float band = 2 / group.across[lane]; // beyond which weights are 0
                SurfacePoint point;
                bool is_read = false; // read lazily: most splats behind the surface are not needed
                pixels.for_each_in_box(
                    e.left[lane], e.right[lane], e.top[lane], e.bottom[lane], [&](int x, int y, std::size_t pixel) {
                        const SplatAtPixel splat(e, lane, x, y);
                        if (splat.nearest() - band > side.farthest[pixel])
                            return;
                        alignas(32) std::array<float, SampledPixels::kSamples> weights;
                        if (!weigh_samples(splat, group.across[lane], offsets,
                                           side.depth + pixel * SampledPixels::kSamples, weights.data()))
                            return;
                        if (!is_read)
                            read_point(frame, *block, i + lane, looks, point);
                        is_read = true;
                        add_to_samples<kGroups>(point, weights.data(),
                                                pixels.sums.data() + pixel * kGroups * kGroupChannels);
                    });
            }
        }
    }
}

void blend_samples(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                   const SurfacePoints &looks, const SampledPixels::Offsets &offsets, const BlendedSide &side,
                   SampledPixels &pixels) {
    const auto blend = pixels.groups == 1 ? blend_groups<1> : pixels.groups == 2 ? blend_groups<2> : blend_groups<3>;
    blend(frame, strip, points, looks, offsets, side, pixels);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_samples);
HWY_EXPORT(blend_samples);

void draw_samples(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SampledPixels::Offsets &offsets, const float *hiding, SampledPixels &pixels) {
    HWY_DYNAMIC_DISPATCH(draw_samples)(frame, strip, points, offsets, hiding, pixels);
}

void blend_samples(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                   const SurfacePoints &looks, const SampledPixels::Offsets &offsets, const BlendedSide &side,
                   SampledPixels &pixels) {
    HWY_DYNAMIC_DISPATCH(blend_samples)(frame, strip, points, looks, offsets, side, pixels);
}

} // namespace pbm
#endif // HWY_ONCE
