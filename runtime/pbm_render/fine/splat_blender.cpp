#include "pbm_render/fine/splat_blender.h"

#include "pbm_render/splats/brick_bounds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/fine/splat_blender.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/fine/soft_splats.h"
#include "pbm_render/splats/hidden_splats.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Group = hn::CappedTag<float, kGroupChannels>;

// Edge, in pixels, of the largest block for which a group is drawn pixel by pixel, all splats at once.
inline constexpr std::int32_t kSmallBlock = 7;

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

// Values that all splats of a block share.
struct Blending {
    const StripRun &at;
    const StripPoints::Block &block;
    const SurfacePoints &looks;
    SurfaceBuffer &surface;
};

// Adds a point to `kPixels` pixels of each of `kRows` rows.
template <std::size_t kGroups, std::size_t kRows, std::size_t kPixels>
HWY_INLINE void add_point(const SurfacePoint &point, const float *weights, SurfaceGroup *to, std::size_t stride) {
    const Group d;
    constexpr std::size_t kChannels = kGroups * kGroupChannels;
    for (std::size_t i = 0; i < kChannels; i += hn::Lanes(d)) {
        const auto channels = hn::Load(d, point.channels.data() + i);
        for (std::size_t row = 0; row < kRows; ++row)
            for (std::size_t k = 0; k < kPixels; ++k) {
                float *const sums = to[row * stride].channels.data() + k * kChannels + i;
                hn::Store(hn::Add(hn::Load(d, sums), hn::Mul(hn::Set(d, weights[row * kPixels + k]), channels)), d,
                          sums);
            }
    }
}

// Blends a splat of any size, whose ellipse is in `lane`.
template <std::size_t kGroups>
HWY_INLINE void blend_splat(const Blending &blending, const SplatGroup &group, std::size_t lane, std::size_t i) {
    const Group d;
    const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
    const Ellipses &e = group.ellipses;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto xx = set(e.xx[lane]), xy = set(e.xy[lane]), slope_x = set(e.slope_x[lane]),
               across = set(group.across[lane]);
    const std::int32_t left = e.left[lane], right = e.right[lane];
    const auto lane_numbers = hn::ConvertTo(d, hn::LoadU(hn::RebindToSigned<Group>(), kLaneNumbers.data()));
    SurfaceBuffer &surface = blending.surface;
    SurfacePoint point;
    bool is_read = false; // read lazily: most splats behind the surface are not needed
    for (std::int32_t column = left; column < right; column += lanes) {
        const std::int32_t count = std::min(right - column, lanes);
        const auto x = hn::Add(lane_numbers, set(static_cast<float>(column) + 0.5F - e.x[lane]));
        const auto column_form = hn::Mul(xx, x), column_depth = hn::Add(set(e.depth[lane]), hn::Mul(slope_x, x));
        std::size_t offset = surface.offset(column, e.top[lane]);
        for (std::int32_t row = e.top[lane]; row < e.bottom[lane];
             ++row, offset += static_cast<std::size_t>(surface.stride)) {
            const float y = static_cast<float>(row) + 0.5F - e.y[lane];
            const auto form = hn::Add(hn::Mul(x, hn::Add(column_form, hn::Mul(xy, set(y)))), set(e.yy[lane] * y * y));
            const auto depth = hn::Add(column_depth, set(e.slope_y[lane] * y));
            const auto behind = hn::Mul(hn::Sub(depth, hn::LoadU(d, surface.depth.data() + offset)), across);
            const auto weight = blend_weight(d, form, behind);
            if (hn::AllFalse(d, hn::Gt(weight, hn::Zero(d))))
                continue;
            if (!is_read)
                read_point(blending.at.frame, blending.block, i, blending.looks, point);
            is_read = true;
            alignas(64) std::array<float, kGroupChannels> weights;
            hn::Store(weight, d, weights.data());
            SurfaceGroup *to = surface.sums_of(offset);
            for (std::int32_t k = 0; k < count; ++k, to += kGroups)
                add_point<kGroups, 1, 1>(point, weights.data() + k, to, 0);
        }
    }
}

// Small splats are weighed and added in tiles of 4 x 4 pixels without a branch: pixels beside the ellipse have weight
// 0.
inline constexpr std::int32_t kTileEdge = 4;
struct Tile {
    alignas(64) std::array<float, kTileEdge * kTileEdge> weights;
};
alignas(64) inline constexpr std::array<float, 16> kTileX{0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},
    kTileY{0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

// Depths of the visible surface at the pixels of a tile from `row` on, as many as a vector holds.
HWY_INLINE hn::Vec<Group> load_tile(const float *row, std::size_t stride) {
    const Group d;
#if HWY_TARGET <= HWY_AVX2
    const hn::Half<Group> half;
    return hn::Combine(d, hn::LoadU(half, row + stride), hn::LoadU(half, row));
#else
    (void)stride;
    return hn::LoadU(d, row);
#endif
}

// Computes the weights of the splat in `lane` from its box's upper left pixel on. Returns whether one is above 0.
HWY_INLINE bool weigh_tile(const SplatGroup &group, std::size_t lane, const SurfaceBuffer &surface, Tile &tile) {
    const Group d;
    const Ellipses &e = group.ellipses;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto stride = static_cast<std::size_t>(surface.stride);
    const auto first_x = set(static_cast<float>(e.left[lane]) + 0.5F - e.x[lane]),
               first_y = set(static_cast<float>(e.top[lane]) + 0.5F - e.y[lane]);
    const float *const depths = surface.depth.data() + surface.offset(e.left[lane], e.top[lane]);
    auto largest = hn::Zero(d);
    for (std::size_t i = 0; i < tile.weights.size(); i += hn::Lanes(d)) {
        const auto x = hn::Add(first_x, hn::LoadU(d, kTileX.data() + i)),
                   y = hn::Add(first_y, hn::LoadU(d, kTileY.data() + i));
        const auto form = hn::Add(hn::Mul(x, hn::Add(hn::Mul(set(e.xx[lane]), x), hn::Mul(set(e.xy[lane]), y))),
                                  hn::Mul(hn::Mul(set(e.yy[lane]), y), y));
        const auto depth =
            hn::Add(hn::Add(set(e.depth[lane]), hn::Mul(set(e.slope_x[lane]), x)), hn::Mul(set(e.slope_y[lane]), y));
        const auto seen = load_tile(depths + i / kTileEdge * stride + i % kTileEdge, stride);
        const auto weight = blend_weight(d, form, hn::Mul(hn::Sub(depth, seen), set(group.across[lane])));
        hn::Store(weight, d, tile.weights.data() + i);
        largest = hn::Max(largest, weight);
    }
    return !hn::AllFalse(d, hn::Gt(largest, hn::Zero(d)));
}

template <std::size_t kGroups> HWY_INLINE void blend_block(const Blending &blending) {
    SplatGroup group;
    std::array<Tile, kGroupSplats> tiles;
    const FacingPoints &facing = blending.block.points;
    SurfaceBuffer &surface = blending.surface;
    const Ellipses &e = group.ellipses;
    for (std::size_t i = 0; i < facing.count; i += kGroupSplats) {
        project_soft_splats<false>(blending.at, facing, i, group);
        std::uint32_t small = 0, large = 0;
        for (std::size_t lane = 0; lane < kGroupSplats; ++lane) {
            const std::int32_t columns = e.right[lane] - e.left[lane], rows = e.bottom[lane] - e.top[lane];
            const bool is_seen = columns > 0 && rows > 0, fits = columns <= kTileEdge && rows <= kTileEdge;
            small |= static_cast<std::uint32_t>(is_seen && fits) << lane;
            large |= static_cast<std::uint32_t>(is_seen && !fits) << lane;
        }
        std::uint32_t visible = 0;
        for (; small != 0; small &= small - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(small));
            visible |= static_cast<std::uint32_t>(weigh_tile(group, lane, surface, tiles[lane])) << lane;
        }
        for (; visible != 0; visible &= visible - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(visible));
            SurfacePoint point;
            read_point(blending.at.frame, blending.block, i + lane, blending.looks, point);
            add_point<kGroups, kTileEdge, kTileEdge>(point, tiles[lane].weights.data(),
                                                     surface.sums_of(surface.offset(e.left[lane], e.top[lane])),
                                                     static_cast<std::size_t>(surface.stride) * kGroups);
        }
        for (; large != 0; large &= large - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(large));
            blend_splat<kGroups>(blending, group, lane, i + lane);
        }
    }
}

// Whether a pixel of the ellipse in `lane` may be nearer than what is drawn there.
HWY_INLINE bool may_be_visible(const Ellipses &e, std::size_t lane, const DepthStrip &strip) {
    const auto across = static_cast<float>(e.right[lane] - e.left[lane]),
               down = static_cast<float>(e.bottom[lane] - e.top[lane]);
    const float nearest = e.depth[lane] - std::abs(e.slope_x[lane]) * across - std::abs(e.slope_y[lane]) * down;
    const double limit = DepthStrip::pixel(std::max(nearest, 0.0F), 0);
    for (std::int32_t row = e.top[lane]; row < e.bottom[lane]; ++row) {
        const double *const pixels = strip.pixels.data() + strip.offset(0, row);
        for (std::int32_t column = e.left[lane]; column < e.right[lane]; ++column)
            if (pixels[column] >= limit)
                return true;
    }
    return false;
}

// Draws those points that may be visible, and forgets the others: most backs are hidden.
HWY_INLINE void draw_visible_backs(const StripRun &at, FacingPoints &facing, FarthestDepths &farthest,
                                   DepthStrip &strip) {
    draw_near(facing.near, at.frame, strip);
    Ellipses ellipses;
    ellipses.cone = kPlacedCone * at.run.voxel;
    const std::size_t lanes = hn::Lanes(Floats());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < facing.count; i += lanes) {
        if (are_hidden<0, true>(at, facing, i, farthest))
            continue;
        project_ellipses<true>(at, facing, i, ellipses, 0, kSplats); // lanes behind the last point are empty
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if (!may_be_visible(ellipses, lane, strip))
                continue;
            facing.move(i + lane, kept);
            draw_ellipse<true>(ellipses, lane, static_cast<std::uint32_t>(facing.id[kept++]), strip);
        }
    }
    facing.count = kept;
}

HWY_INLINE void draw_points(const StripRun &at, const FacingPoints &facing, DepthStrip &strip) {
    draw_near(facing.near, at.frame, strip);
    SplatGroup group;
    group.ellipses.cone = kPlacedCone * at.run.voxel;
    SmallPixels pixels;
    const Floats d;
    for (std::size_t i = 0; i < facing.count; i += kGroupSplats) {
        for (std::size_t lane = 0; lane < kGroupSplats; lane += hn::Lanes(d))
            project_ellipses<true>(at, facing, i + lane, group.ellipses, lane, kSplats);
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
}

// The block to which a brick's points are appended; null: a new one.
struct OpenBlock {
    StripPoints &of;
    FacingPoints *points = nullptr;

    FacingPoints *open(const RunGeometry &run, std::uint32_t first_id) {
        if (points == nullptr || points->count >= kWaiting)
            points = &of.add(run, first_id).points;
        return points;
    }
};

bool touches(const VisibleBrick &it, const DepthStrip &strip) { return it.top < strip.bottom && it.bottom > strip.top; }

// Adds the points of a brick. Apart, so that there is one copy of the loop.
HWY_NOINLINE std::uint64_t add_points(const StripRun &at, const VisibleBrick &brick, std::uint32_t first_id,
                                      const BothSides &to) {
    return brick.has_backs ? add_brick_with_backs<0, true>(at, brick, first_id, to, kSoftSplats)
                           : add_brick<0, true, false>(at, brick, first_id, to, kSoftSplats);
}

std::uint64_t draw_fronts(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip, StripPoints &fronts, StripPoints &backs) {
    const StripRun at{frame, run, strip};
    OpenBlock front{fronts}, back{backs};
    std::uint64_t added = 0;
    for (const VisibleBrick &it : seen) {
        if (!touches(it, strip) || !it.has_fronts)
            continue;
        const BothSides to{front.open(run, first_id), it.has_backs ? back.open(run, first_id) : nullptr};
        added += add_points(at, it, first_id, to);
        if (to.fronts->count >= kWaiting)
            draw_points(at, *to.fronts, strip);
    }
    if (front.points != nullptr && front.points->count < kWaiting)
        draw_points(at, *front.points, strip);
    return added;
}

std::uint64_t add_backs(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                        std::uint32_t first_id, const DepthStrip &strip, FarthestDepths &farthest, StripPoints &backs) {
    const StripRun at{frame, run, strip};
    OpenBlock back{backs};
    std::uint64_t added = 0;
    for (const VisibleBrick &it : seen)
        if (touches(it, strip) && !it.has_fronts && !farthest.hide(it))
            added += add_points(at, it, first_id, {nullptr, back.open(run, first_id)});
    return added;
}

// Forgets the points of a block from `first` on whose soft ellipses reach no chosen pixel.
void keep_near(const StripRun &at, const ChosenCounts &chosen, std::size_t first, FacingPoints &facing) {
    constexpr float kSlack = 1.02F;    // packed normals are up to 1 % too long
    constexpr float kRounding = 0.05F; // pixels
    const FrameGeometry &frame = at.frame;
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const float inset = kPlacedOutlineInset + (facing.are_backs ? kBackOutlineInset : 0);
    std::size_t kept = first;
    for (std::size_t i = first; i < facing.count; i += hn::Lanes(d)) {
        const Mask valid = hn::FirstN(d, facing.count - i);
        const Vector x = hn::LoadU(d, facing.x.data() + i), y = hn::LoadU(d, facing.y.data() + i);
        const Vector off_axis =
            hn::Max(hn::Abs(hn::Sub(x, set(frame.middle_x))), hn::Abs(hn::Sub(y, set(frame.middle_y))));
        const Vector pixels = hn::Div(hn::Mul(set(kSlack), hn::Add(set(frame.focal), off_axis)),
                                      hn::LoadU(d, facing.w.data() + i)); // of a length of 1
        const Vector radius = hn::Mul(hn::Mul(set(kKernelRadius), hn::LoadU(d, facing.radius.data() + i)), pixels);
        const Vector moved = hn::Mul(
            hn::Mul(hn::Add(set(inset), hn::Abs(hn::LoadU(d, facing.offset.data() + i))), set(at.run.voxel)), pixels);
        const Vector reach = hn::Add(hn::Sqrt(hn::Add(hn::Mul(radius, radius), set(kLowPass * kLowPass))),
                                     hn::Add(moved, set(kRounding)));
        const auto edge = [&](Vector v, int from, int end) {
            const Vector clamped =
                hn::Min(hn::Max(hn::Floor(v), set(static_cast<float>(from))), set(static_cast<float>(end)));
            return hn::ConvertTo(di, hn::IfThenElseZero(valid, clamped));
        };
        const Vector one = set(1);
        const Mask keep =
            hn::And(valid, hold_chosen(chosen, edge(hn::Sub(x, reach), 0, chosen.width()),
                                       edge(hn::Add(hn::Add(x, reach), one), 0, chosen.width()),
                                       edge(hn::Sub(y, reach), chosen.top(), chosen.bottom()),
                                       edge(hn::Add(hn::Add(y, reach), one), chosen.top(), chosen.bottom())));
        if (hn::AllFalse(d, keep))
            continue;
        const Packing pack(keep);
        for (auto *const of : {&facing.x, &facing.y, &facing.w, &facing.offset, &facing.radius})
            hn::StoreU(pack(hn::LoadU(d, of->data() + i)), d, of->data() + kept);
        for (auto *const of : {&facing.normal, &facing.id, &facing.normal_index})
            hn::StoreU(pack(hn::LoadU(di, of->data() + i)), di, of->data() + kept);
        kept += hn::CountTrue(d, keep);
    }
    facing.count = kept;
}

void find_points(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                 std::uint32_t first_id, const DepthStrip &strip, const ChosenCounts &chosen, StripPoints &fronts,
                 StripPoints &backs) {
    const StripRun at{frame, run, strip};
    OpenBlock front{fronts}, back{backs};
    for (const VisibleBrick &it : seen) {
        if (!chosen.touch(it))
            continue;
        const BothSides to{it.has_fronts ? front.open(run, first_id) : nullptr,
                           it.has_backs ? back.open(run, first_id) : nullptr};
        const std::size_t first = to.fronts != nullptr ? to.fronts->count : 0,
                          first_back = to.backs != nullptr ? to.backs->count : 0;
        add_points(at, it, first_id, to);
        if (to.fronts != nullptr)
            keep_near(at, chosen, first, *to.fronts);
        if (to.backs != nullptr)
            keep_near(at, chosen, first_back, *to.backs);
    }
}

void draw_and_keep_visible(const FrameGeometry &frame, StripPoints &backs, FarthestDepths &farthest,
                           DepthStrip &strip) {
    for (const std::unique_ptr<StripPoints::Block> &block : backs.blocks())
        draw_visible_backs(StripRun{frame, *block->run, strip}, block->points, farthest, strip);
}

void blend_points(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SurfacePoints &looks, SurfaceBuffer &surface) {
    for (const std::unique_ptr<StripPoints::Block> &block : points.blocks()) {
        const StripRun at{frame, *block->run, strip};
        const Blending blending{at, *block, looks, surface};
        if (surface.groups == 1)
            blend_block<1>(blending);
        else if (surface.groups == 2)
            blend_block<2>(blending);
        else
            blend_block<3>(blending);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_fronts);
HWY_EXPORT(add_backs);
HWY_EXPORT(find_points);
HWY_EXPORT(draw_and_keep_visible);
HWY_EXPORT(blend_points);

std::uint64_t draw_fronts(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip, StripPoints &fronts, StripPoints &backs) {
    return HWY_DYNAMIC_DISPATCH(draw_fronts)(frame, run, seen, first_id, strip, fronts, backs);
}

std::uint64_t add_backs(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                        std::uint32_t first_id, const DepthStrip &strip, FarthestDepths &farthest, StripPoints &backs) {
    return HWY_DYNAMIC_DISPATCH(add_backs)(frame, run, seen, first_id, strip, farthest, backs);
}

void find_points(const FrameGeometry &frame, const RunGeometry &run, std::span<const VisibleBrick> seen,
                 std::uint32_t first_id, const DepthStrip &strip, const ChosenCounts &chosen, StripPoints &fronts,
                 StripPoints &backs) {
    HWY_DYNAMIC_DISPATCH(find_points)(frame, run, seen, first_id, strip, chosen, fronts, backs);
}

void draw_and_keep_visible(const FrameGeometry &frame, StripPoints &backs, FarthestDepths &farthest,
                           DepthStrip &strip) {
    HWY_DYNAMIC_DISPATCH(draw_and_keep_visible)(frame, backs, farthest, strip);
}

void blend_points(const FrameGeometry &frame, const DepthStrip &strip, const StripPoints &points,
                  const SurfacePoints &looks, SurfaceBuffer &surface) {
    HWY_DYNAMIC_DISPATCH(blend_points)(frame, strip, points, looks, surface);
}

void make_bricks_soft(const FrameGeometry &frame, const RunGeometry &run, std::span<VisibleBrick> seen) {
    for (VisibleBrick &it : seen)
        it.block = 0;
    bound_bricks(frame, run, seen);
    const auto height = static_cast<float>(frame.height), width = static_cast<float>(frame.width);
    const float stretch_x = 1 + frame.middle_x * frame.inverse_focal, // at the borders of the picture
        stretch_y = 1 + frame.middle_y * frame.inverse_focal;
    for (VisibleBrick &it : seen) {
        const float radius = frame.radii[run.run->chunk->bricks[it.brick].largest_radius];
        const float nearest = it.w - kBrickReach * run.voxel - radius;
        const float extra =
            nearest > 0 ? kKernelRadius * radius * frame.focal / nearest + kLowPass : std::max(width, height);
        const auto widen = [&](std::int32_t &first, std::int32_t &end, float stretch, float size) {
            first = static_cast<std::int32_t>(std::max(static_cast<float>(first) - extra * stretch, 0.0F));
            end = static_cast<std::int32_t>(std::min(static_cast<float>(end) + extra * stretch + 1, size));
        };
        widen(it.left, it.right, stretch_x, width);
        widen(it.top, it.bottom, stretch_y, height);
    }
}

} // namespace pbm
#endif // HWY_ONCE
