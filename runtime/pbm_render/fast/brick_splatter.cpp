#include "pbm_render/fast/brick_splatter.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/fast/brick_splatter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/splats/splat_projection.h"

#ifndef PBM_RENDER_BRICK_SPLATTER_TABLES
#define PBM_RENDER_BRICK_SPLATTER_TABLES
namespace pbm {

// How far a placed block lies behind its plane one pixel from its middle, in voxel edges.
inline constexpr float kPlacedBlockCone = 1.2F;

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

struct Blocks {
    alignas(64) std::array<std::int32_t, FacingPoints::kCapacity> offset; // of the upper left pixel
    alignas(64) std::array<float, 4 * FacingPoints::kCapacity> depths;    // upper left and right, lower left and right
};

HWY_INLINE void draw_block(const float *depths, std::uint32_t id, double *upper, std::ptrdiff_t stride) {
    double *const lower = upper + stride;
#if HWY_TARGET == HWY_SCALAR
    for (std::size_t i = 0; i < 2; ++i) {
        upper[i] = std::min(upper[i], DepthStrip::pixel(depths[i], id));
        lower[i] = std::min(lower[i], DepthStrip::pixel(depths[2 + i], id));
    }
#else
    const hn::FixedTag<float, 4> d32;
    const hn::FixedTag<double, 2> d64;
    const hn::FixedTag<double, 1> pixel;
    const hn::FixedTag<std::uint32_t, 4> du32;
    const auto ids = hn::Set(du32, id);
    const auto z = hn::BitCast(du32, hn::Load(d32, depths));
    const auto first = hn::BitCast(d64, hn::InterleaveLower(du32, ids, z));
    const auto second = hn::BitCast(d64, hn::InterleaveUpper(du32, ids, z));
    // Load and store one pixel at a time: the previous block often stored one of them, and a load is fast only if it
    // has the size of that store.
    const auto draw = [&](auto value, double *to) {
        hn::StoreU(lesser_doubles(value, hn::LoadU(pixel, to)), pixel, to);
    };
    draw(hn::LowerHalf(first), upper);
    draw(hn::UpperHalf(pixel, first), upper + 1);
    draw(hn::LowerHalf(second), lower);
    draw(hn::UpperHalf(pixel, second), lower + 1);
#endif
}

// Computes the blocks of a vector of points from `first` on. Lanes behind the last point get unused blocks.
template <bool kPlaced>
HWY_INLINE void project_blocks(const StripRun &at, const FacingPoints &points, std::size_t first, Blocks &blocks) {
    const FrameGeometry &frame = at.frame;
    const DepthStrip &strip = at.strip;
    const float voxel_edge = at.run.voxel;
    const std::size_t end = points.count;
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector half = set(0.5F);
    const ProjectedSplats s = project_splats<kPlaced>(
        frame, voxel_edge, kPlaced ? kPlacedBlockOutlineInset : kBlockOutlineInset, points, first);
    const SeenNormal &n = s.normal;
    const Vector inverse = hn::Div(set(1), hn::Mul(s.pixel_size, s.cosine)); // one division for two
    const Vector inverse_cosine = hn::Mul(inverse, s.pixel_size);
    const Vector outline_pixels = hn::Mul(s.outline, hn::Mul(inverse, s.cosine));
    const Vector at_x = hn::Sub(hn::Load(d, points.x.data() + first), hn::Mul(outline_pixels, s.image_x));
    const Vector at_y = hn::Sub(hn::Load(d, points.y.data() + first), hn::Mul(outline_pixels, s.image_y));
    const float steepest = kPlaced ? kPlacedSteepest : kSteepest;
    const Vector plane_x = plane_slope(n.x, inverse_cosine, steepest),
                 plane_y = plane_slope(n.y, inverse_cosine, steepest);
    const Vector at_z = depth_in_middle(s, hn::Load(d, points.w.data() + first), plane_x, plane_y);
    const Vector slope_x = hn::Mul(plane_x, s.pixel_size), slope_y = hn::Mul(plane_y, s.pixel_size);

    // The 2 x 2 pixels whose centres surround the point. A block outside of the strip is drawn to an unused place.
    const auto within = [&](Vector v, int from, int to) {
        return hn::And(hn::Ge(v, set(static_cast<float>(from))), hn::Lt(v, set(static_cast<float>(to))));
    };
    const Vector column = hn::Floor(hn::Sub(at_x, half)), row = hn::Floor(hn::Sub(at_y, half));
    const Mask visible = hn::And(hn::FirstN(d, end - first),
                                 hn::And(within(column, -1, strip.width), within(row, strip.top - 1, strip.bottom)));
    const auto offset =
        hn::Add(hn::Add(hn::ConvertTo(di, column), hn::Set(di, DepthStrip::kMarginLeft)),
                hn::Mul(hn::Sub(hn::ConvertTo(di, row), hn::Set(di, strip.top - 1)), hn::Set(di, strip.stride)));
    hn::Store(hn::IfThenElse(hn::RebindMask(di, visible), offset, hn::Set(di, strip.unseen())), di,
              blocks.offset.data() + first);
    // From the middle of the splat to the centres of the pixels.
    const Vector left = hn::Sub(hn::Add(column, half), at_x), upper = hn::Sub(hn::Add(row, half), at_y);
    const Vector depth = hn::Add(at_z, hn::Add(hn::Mul(slope_x, left), hn::Mul(slope_y, upper)));
    const Vector next = hn::Add(depth, slope_x);
    std::array<Vector, 4> depths{depth, next, hn::Add(depth, slope_y), hn::Add(next, slope_y)};
    if constexpr (kPlaced) {
        const Vector one = set(1), cone = set(kPlacedBlockCone * voxel_edge);
        const Vector right = hn::Add(left, one), lower = hn::Add(upper, one);
        const Vector left2 = hn::Mul(left, left), right2 = hn::Mul(right, right);
        const Vector upper2 = hn::Mul(upper, upper), lower2 = hn::Mul(lower, lower);
        depths = {hn::Add(depths[0], hn::Mul(cone, hn::Add(left2, upper2))),
                  hn::Add(depths[1], hn::Mul(cone, hn::Add(right2, upper2))),
                  hn::Add(depths[2], hn::Mul(cone, hn::Add(left2, lower2))),
                  hn::Add(depths[3], hn::Mul(cone, hn::Add(right2, lower2)))};
    }
    hn::StoreInterleaved4(depths[0], depths[1], depths[2], depths[3], d, blocks.depths.data() + 4 * first);
}

// Draws all points as blocks. All blocks are computed before the first is drawn, so that latencies overlap.
template <bool kPlaced>
HWY_INLINE void draw_blocks(const StripRun &at, Blocks &blocks, FacingPoints &points, DepthStrip &strip) {
    for (std::size_t i = 0; i < points.count; i += hn::Lanes(Floats()))
        project_blocks<kPlaced>(at, points, i, blocks);
    for (std::size_t i = 0; i < points.count; ++i)
        draw_block(blocks.depths.data() + 4 * i, static_cast<std::uint32_t>(points.id[i]),
                   strip.pixels.data() + blocks.offset[i], strip.stride);
    points.count = 0;
}

// Draws all points as ellipses, whatever their size.
template <bool kPlaced> HWY_INLINE void draw_ellipses(const StripRun &at, FacingPoints &points, DepthStrip &strip) {
    Ellipses ellipses;
    ellipses.cone = kPlacedCone * at.run.voxel;
    const std::size_t lanes = hn::Lanes(Floats());
    for (std::size_t i = 0; i < points.count; i += lanes) {
        project_ellipses<kPlaced>(at, points, i, ellipses);
        for (std::size_t lane = 0; lane < lanes; ++lane)
            if (ellipses.left[lane] < ellipses.right[lane] && ellipses.top[lane] < ellipses.bottom[lane])
                draw_ellipse<kPlaced>(ellipses, lane, static_cast<std::uint32_t>(points.id[i + lane]), strip);
    }
    points.count = 0;
}

// Whether all pixels of the strip that a brick may touch show nearer points already.
HWY_INLINE bool is_hidden(const SeenBrick &it, const DepthStrip &strip) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    const int top = std::max(it.top, strip.top), bottom = std::min(it.bottom, strip.bottom);
    const auto width = static_cast<std::size_t>(it.right - it.left);
    const Vector nearest = hn::Set(d, it.nearest);
    for (int y = top; y < bottom; ++y) {
        const auto *const row = reinterpret_cast<const float *>(strip.pixels.data() + strip.offset(it.left, y));
        for (std::size_t x = 0; x < width; x += lanes) {
            Vector id, depth;
            hn::LoadInterleaved2(d, row + 2 * x, id, depth); // rows are padded for whole vectors
            if (!hn::AllFalse(d, hn::And(hn::Ge(depth, nearest), hn::FirstN(d, width - x))))
                return false;
        }
    }
    return true;
}

// Draws bricks of one run.
template <bool kPlaced>
HWY_INLINE std::uint64_t draw_all(const StripRun &at, std::span<const SeenBrick> seen,
                                  std::span<const StripBricks::Brick> bricks, std::uint32_t first_id,
                                  DepthStrip &strip) {
    Blocks blocks;
    FacingPoints small, large;
    std::uint64_t drawn = 0;
    for (const StripBricks::Brick &brick : bricks) {
        const SeenBrick &it = seen[brick.seen];
        if (is_hidden(it, strip))
            continue;
        if (it.large) {
            drawn += add_brick<true, kPlaced>(at, it, first_id, large);
            if (large.count >= kWaiting)
                draw_ellipses<kPlaced>(at, large, strip);
        } else {
            drawn += add_brick<false, kPlaced>(at, it, first_id, small);
            if (small.count >= kWaiting)
                draw_blocks<kPlaced>(at, blocks, small, strip);
        }
    }
    draw_ellipses<kPlaced>(at, large, strip);
    draw_blocks<kPlaced>(at, blocks, small, strip);
    return drawn;
}

std::uint64_t draw_bricks(const FrameGeometry &frame, const StripBricks &list, DepthStrip &strip) {
    std::uint64_t drawn = 0;
    for (std::span<const StripBricks::Brick> left = list.bricks(); !left.empty();) {
        const std::uint32_t number = left.front().run;
        const auto other =
            std::find_if(left.begin(), left.end(), [&](const auto &brick) { return brick.run != number; });
        const auto of_run = left.first(static_cast<std::size_t>(other - left.begin()));
        left = left.subspan(of_run.size());
        const StripBricks::Run &run = list.run(number);
        const StripRun at{frame, *run.geometry, strip};
        drawn += run.geometry->run->offsets != nullptr ? draw_all<true>(at, run.seen, of_run, run.first_id, strip)
                                                       : draw_all<false>(at, run.seen, of_run, run.first_id, strip);
    }
    return drawn;
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_bricks);

std::uint64_t draw_bricks(const FrameGeometry &frame, const StripBricks &bricks, DepthStrip &strip) {
    return HWY_DYNAMIC_DISPATCH(draw_bricks)(frame, bricks, strip);
}

} // namespace pbm
#endif // HWY_ONCE
