#include "pbm_render/fine/splat_blender.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/fine/splat_blender.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/splats/splat_projection.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Group = hn::CappedTag<float, kGroupChannels>;

// Splats of a group: the same number on every target, so that all targets add in the same order.
inline constexpr std::size_t kGroupSplats = kMaxLanes;
// Edge, in pixels, of the largest block for which a group is drawn pixel by pixel, all splats at once.
inline constexpr std::int32_t kSmallBlock = 7;

struct SplatGroup {
    Ellipses ellipses;
    alignas(64) std::array<float, kGroupSplats> across; // converts differences of depths to halves of kBlendBand
    std::int32_t columns, rows;                         // pixels of the largest box
};

HWY_INLINE void measure_group(SplatGroup &group) {
    group.columns = group.rows = 0;
    const Ellipses &e = group.ellipses;
    for (std::size_t i = 0; i < kGroupSplats; ++i) {
        group.columns = std::max(group.columns, e.right[i] - e.left[i]);
        group.rows = std::max(group.rows, e.bottom[i] - e.top[i]);
    }
}

// Pixels of the small splats of a group: [splats * pixels of a block], padded by one vector.
struct SmallPixels {
    static constexpr std::size_t kCapacity = kGroupSplats * kSmallBlock * kSmallBlock + kMaxLanes;
    std::size_t count = 0;
    alignas(64) std::array<std::int32_t, kCapacity> splat, offset;
    alignas(64) std::array<float, kCapacity> value; // depth or weight
};

// One pixel of each splat's box.
struct BoxPixels {
    Vector form, depth; // quadratic form, 1 on the outline; depth of the plane
    IntVector offset;
    Mask inside; // of the box
};

// Pixel (x, y) of a buffer has the index origin + x + (y - top) * stride.
struct BufferRows {
    std::int32_t origin, top, stride;
};

// Visits the boxes of a group pixel by pixel. `visit(first splat, pixels)` returns pixels to keep, and values.
template <class Visit>
HWY_INLINE void list_small_pixels(const SplatGroup &group, const BufferRows &buffer, SmallPixels &to,
                                  const Visit &visit) {
    const auto [origin, top, stride] = buffer;
    const Floats d;
    const Ints di;
    const Vector half = hn::Set(d, 0.5F);
    const Ellipses &e = group.ellipses;
    to.count = 0;
    for (std::int32_t row = 0; row < group.rows; ++row)
        for (std::int32_t column = 0; column < group.columns; ++column)
            for (std::size_t i = 0; i < kGroupSplats; i += hn::Lanes(d)) {
                const auto load = [&](const auto &of) { return hn::Load(d, of.data() + i); };
                const auto load_int = [&](const auto &of) { return hn::Load(di, of.data() + i); };
                const IntVector at_x = hn::Add(load_int(e.left), hn::Set(di, column)),
                                at_y = hn::Add(load_int(e.top), hn::Set(di, row));
                const Vector x = hn::Sub(hn::Add(hn::ConvertTo(d, at_x), half), load(e.x)),
                             y = hn::Sub(hn::Add(hn::ConvertTo(d, at_y), half), load(e.y));
                BoxPixels pixels;
                pixels.form = hn::Add(hn::Mul(x, hn::Add(hn::Mul(load(e.xx), x), hn::Mul(load(e.xy), y))),
                                      hn::Mul(hn::Mul(load(e.yy), y), y));
                pixels.depth =
                    hn::Add(hn::Add(load(e.depth), hn::Mul(load(e.slope_y), y)), hn::Mul(load(e.slope_x), x));
                const auto inside = hn::And(hn::Lt(at_x, load_int(e.right)), hn::Lt(at_y, load_int(e.bottom)));
                pixels.inside = hn::RebindMask(d, inside);
                pixels.offset =
                    hn::IfThenElseZero(inside, hn::Add(hn::Add(at_x, hn::Set(di, origin)),
                                                       hn::Mul(hn::Sub(at_y, hn::Set(di, top)), hn::Set(di, stride))));
                const auto [keep, value] = visit(i, pixels);
                const Packing pack(keep);
                hn::StoreU(pack(pixels.offset), di, to.offset.data() + to.count);
                hn::StoreU(pack(value), d, to.value.data() + to.count);
                hn::StoreU(pack(count_from(static_cast<std::int32_t>(i))), di, to.splat.data() + to.count);
                to.count += hn::CountTrue(d, keep);
            }
}

struct Kept {
    Mask keep;
    Vector value;
};

// Values that all splats of a run share.
struct Blending {
    const StripRun &at;
    const SurfacePoints &points;
    SurfaceBuffer &surface;
};

HWY_INLINE void read_point(const Blending &blending, const FacingPoints &facing, std::size_t i, SurfacePoint &to) {
    const FrameGeometry &frame = blending.at.frame;
    const EyeNormal &n = frame.normals[static_cast<std::size_t>(facing.normal_index[i]) & kNormalIndexMask];
    const float ray_x = (facing.x[i] - frame.middle_x) * frame.inverse_focal,
                ray_y = (facing.y[i] - frame.middle_y) * frame.inverse_focal;
    const bool turn = (facing.normal[i] & kPackedTwoSided) != 0 && n.x * ray_x + n.y * ray_y + n.z > 0;
    const float sign = turn ? -1.0F : 1.0F;
    to.channels[channel::kNormal] = sign * n.x;
    to.channels[channel::kNormal + 1] = sign * n.y;
    to.channels[channel::kNormal + 2] = sign * n.z;
    to.channels[channel::kWeight] = 1;
    blending.points.read(*blending.at.run.run, static_cast<std::size_t>(facing.id[i]), to);
}

template <std::size_t kGroups> HWY_INLINE void add_point(const SurfacePoint &point, float weight, SurfaceGroup *to) {
    const Group d;
    const auto w = hn::Set(d, weight);
    float *const sums = to->channels.data();
    for (std::size_t i = 0; i < kGroups * kGroupChannels; i += hn::Lanes(d))
        hn::Store(hn::Add(hn::Load(d, sums + i), hn::Mul(w, hn::Load(d, point.channels.data() + i))), d, sums + i);
}

// The weight of a splat at a pixel. `form`: the quadratic form there; `behind`: distance of the visible surface from
// the plane in halves of kBlendBand. The weight is 0 outside the splat and where there is no surface.
template <class D, class V = hn::Vec<D>> HWY_INLINE V blend_weight(D d, V form, V behind) {
    const auto zero = hn::Zero(d), one = hn::Set(d, 1);
    const V near = hn::Max(hn::Sub(hn::Set(d, 2), hn::Abs(behind)), zero), inside = hn::Max(hn::Sub(one, form), zero);
    return hn::Mul(hn::Mul(inside, inside), hn::Min(near, one));
}

template <std::size_t kGroups>
HWY_INLINE void blend_splat(const Blending &blending, const SplatGroup &group, std::size_t lane,
                            const FacingPoints &facing, std::size_t i) {
    const Group d;
    const Ellipses &e = group.ellipses;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto xx = set(e.xx[lane]), slope_x = set(e.slope_x[lane]), across = set(group.across[lane]);
    const std::int32_t left = e.left[lane], right = e.right[lane];
    const auto lane_numbers = hn::ConvertTo(d, hn::LoadU(hn::RebindToSigned<Group>(), kLaneNumbers.data()));
    const auto middle = set(e.x[lane]);
    SurfaceBuffer &surface = blending.surface;
    SurfacePoint point;
    bool is_read = false; // read lazily: most splats behind the surface are not needed
    for (std::int32_t row = e.top[lane]; row < e.bottom[lane]; ++row) {
        const float y = static_cast<float>(row) + 0.5F - e.y[lane];
        const auto row_xy = set(e.xy[lane] * y), row_yy = set(e.yy[lane] * y * y),
                   row_depth = set(e.depth[lane] + e.slope_y[lane] * y);
        for (std::int32_t column = left; column < right; column += static_cast<std::int32_t>(hn::Lanes(d))) {
            const std::size_t offset = surface.offset(column, row);
            const auto x = hn::Sub(hn::Add(lane_numbers, set(static_cast<float>(column) + 0.5F)), middle);
            const auto form = hn::Add(hn::Mul(x, hn::Add(hn::Mul(xx, x), row_xy)), row_yy);
            const auto behind = hn::Mul(
                hn::Sub(hn::Add(row_depth, hn::Mul(slope_x, x)), hn::LoadU(d, surface.depth.data() + offset)), across);
            const auto weight = blend_weight(d, form, behind);
            const auto some = hn::Gt(weight, hn::Zero(d));
            if (hn::AllFalse(d, some))
                continue;
            if (!is_read)
                read_point(blending, facing, i, point);
            is_read = true;
            alignas(64) std::array<float, kGroupChannels> weights;
            std::array<std::uint8_t, 8> bits{};
            hn::Store(weight, d, weights.data());
            hn::StoreMaskBits(d, some, bits.data());
            for (unsigned rest = bits[0]; rest != 0; rest &= rest - 1) {
                const auto k = static_cast<std::size_t>(std::countr_zero(rest));
                add_point<kGroups>(point, weights[k], surface.sums_of(offset + k));
            }
        }
    }
}

// As blend_splat, for all splats of a group.
template <std::size_t kGroups>
HWY_INLINE void blend_small_splats(const Blending &blending, const SplatGroup &group, const FacingPoints &facing,
                                   std::size_t first, SmallPixels &pixels) {
    const Floats d;
    SurfaceBuffer &surface = blending.surface;
    list_small_pixels(group, {0, surface.top, surface.stride}, pixels, [&](std::size_t i, const BoxPixels &box) {
        const Vector visible = hn::GatherIndex(d, surface.depth.data(), box.offset);
        const Vector behind = hn::Mul(hn::Sub(box.depth, visible), hn::Load(d, group.across.data() + i));
        const Vector weight = blend_weight(d, box.form, behind);
        return Kept{hn::And(box.inside, hn::Gt(weight, hn::Zero(d))), weight};
    });
    std::uint32_t used = 0;
    for (std::size_t i = 0; i < pixels.count; ++i)
        used |= 1U << pixels.splat[i];
    std::array<SurfacePoint, kGroupSplats> points;
    for (; used != 0; used &= used - 1) {
        const auto splat = static_cast<std::size_t>(std::countr_zero(used));
        read_point(blending, facing, first + splat, points[splat]);
    }
    for (std::size_t i = 0; i < pixels.count; ++i)
        add_point<kGroups>(points[static_cast<std::size_t>(pixels.splat[i])], pixels.value[i],
                           surface.sums_of(static_cast<std::size_t>(pixels.offset[i])));
}

HWY_INLINE void project_soft_splats(const StripRun &at, const FacingPoints &facing, std::size_t first, SplatGroup &to) {
    const Floats d;
    for (std::size_t i = 0; i < kGroupSplats; i += hn::Lanes(d)) {
        const ProjectedSplats splats = project_ellipses<true>(at, facing, first + i, to.ellipses, i,
                                                              {.radius = kKernelRadius, .low_pass = kLowPass});
        const Vector band = hn::Mul(hn::Set(d, kBlendBand / 2), hn::LoadU(d, facing.radius.data() + first + i));
        hn::Store(hn::Div(hn::Max(splats.cosine, hn::Set(d, kBandCosine)), band), d, to.across.data() + i);
    }
    measure_group(to);
}

template <std::size_t kGroups> HWY_INLINE void blend_points(const Blending &blending, FacingPoints &facing) {
    SplatGroup group;
    SmallPixels pixels;
    for (std::size_t i = 0; i < facing.count; i += kGroupSplats) {
        project_soft_splats(blending.at, facing, i, group);
        if (group.columns <= kSmallBlock && group.rows <= kSmallBlock) {
            blend_small_splats<kGroups>(blending, group, facing, i, pixels);
            continue;
        }
        const Ellipses &e = group.ellipses;
        for (std::size_t lane = 0; lane < kGroupSplats; ++lane)
            if (e.left[lane] < e.right[lane] && e.top[lane] < e.bottom[lane])
                blend_splat<kGroups>(blending, group, lane, facing, i + lane);
    }
    facing.count = 0;
}

HWY_INLINE void draw_points(const StripRun &at, FacingPoints &facing, DepthStrip &strip) {
    SplatGroup group;
    group.ellipses.cone = kPlacedCone * at.run.voxel;
    SmallPixels pixels;
    const Floats d;
    for (std::size_t i = 0; i < facing.count; i += kGroupSplats) {
        for (std::size_t lane = 0; lane < kGroupSplats; lane += hn::Lanes(d))
            project_ellipses<true>(at, facing, i + lane, group.ellipses, lane);
        measure_group(group);
        const Ellipses &e = group.ellipses;
        const auto id = [&](std::size_t lane) { return static_cast<std::uint32_t>(facing.id[i + lane]); };
        if (group.columns > kSmallBlock || group.rows > kSmallBlock) {
            for (std::size_t lane = 0; lane < kGroupSplats; ++lane)
                if (e.left[lane] < e.right[lane] && e.top[lane] < e.bottom[lane])
                    draw_ellipse<true>(e, lane, id(lane), strip);
            continue;
        }
        list_small_pixels(group, {DepthStrip::kMarginLeft, strip.top - DepthStrip::kMarginRows, strip.stride}, pixels,
                          [&](std::size_t, const BoxPixels &box) {
                              const Vector depth = hn::Add(box.depth, hn::Mul(box.form, hn::Set(d, e.cone)));
                              return Kept{hn::And(box.inside, hn::Le(box.form, hn::Set(d, 1))), depth};
                          });
        for (std::size_t k = 0; k < pixels.count; ++k) {
            double &pixel = strip.pixels[static_cast<std::size_t>(pixels.offset[k])];
            pixel = std::min(pixel, DepthStrip::pixel(pixels.value[k], id(static_cast<std::size_t>(pixels.splat[k]))));
        }
    }
    facing.count = 0;
}

std::uint64_t draw_visible(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                           std::uint32_t first_id, DepthStrip &strip) {
    const StripRun at{frame, run, strip};
    FacingPoints facing;
    std::uint64_t drawn = 0;
    for (const SeenBrick &it : seen) {
        if (it.top >= strip.bottom || it.bottom <= strip.top)
            continue;
        drawn += add_brick<0, true>(at, it, first_id, facing);
        if (facing.count >= kWaiting)
            draw_points(at, facing, strip);
    }
    draw_points(at, facing, strip);
    return drawn;
}

template <std::size_t kGroups> HWY_INLINE void blend_all(const Blending &blending, std::span<const SeenBrick> seen) {
    const DepthStrip &strip = blending.at.strip;
    FacingPoints facing;
    for (const SeenBrick &it : seen) {
        if (it.top >= strip.bottom || it.bottom <= strip.top)
            continue;
        add_brick<0, true>(blending.at, it, 0, facing);
        if (facing.count >= kWaiting)
            blend_points<kGroups>(blending, facing);
    }
    blend_points<kGroups>(blending, facing);
}

void blend_bricks(const StripRun &at, std::span<const SeenBrick> seen, const SurfacePoints &points,
                  SurfaceBuffer &surface) {
    const Blending blending{at, points, surface};
    if (surface.groups == 1)
        blend_all<1>(blending, seen);
    else if (surface.groups == 2)
        blend_all<2>(blending, seen);
    else
        blend_all<3>(blending, seen);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_visible);
HWY_EXPORT(blend_bricks);

std::uint64_t draw_visible(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                           std::uint32_t first_id, DepthStrip &strip) {
    return HWY_DYNAMIC_DISPATCH(draw_visible)(frame, run, seen, first_id, strip);
}

void blend_bricks(const StripRun &at, std::span<const SeenBrick> seen, const SurfacePoints &points,
                  SurfaceBuffer &surface) {
    HWY_DYNAMIC_DISPATCH(blend_bricks)(at, seen, points, surface);
}

void widen_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<SeenBrick> seen) {
    const auto height = static_cast<float>(frame.height);
    const float stretch = 1 + frame.middle_y * frame.inverse_focal; // at the upper and lower borders
    for (SeenBrick &it : seen) {
        const float radius = frame.radii[run.run->chunk->bricks[it.brick].largest_radius];
        const float nearest = it.w - kBrickReach * run.voxel - radius;
        it.block = 0;
        const float extra =
            nearest > 0 ? (kKernelRadius * radius * frame.focal / nearest + kLowPass) * stretch : height;
        it.top = static_cast<std::int32_t>(std::max(static_cast<float>(it.top) - extra, 0.0F));
        it.bottom = static_cast<std::int32_t>(std::min(static_cast<float>(it.bottom) + extra + 1, height));
    }
}

} // namespace pbm
#endif // HWY_ONCE
