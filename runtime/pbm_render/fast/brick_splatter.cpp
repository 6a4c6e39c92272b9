#include "pbm_render/fast/brick_splatter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <memory>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/fast/brick_splatter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/splats/splat_projection.h"

#ifndef PBM_RENDER_BRICK_SPLATTER_TABLES
#define PBM_RENDER_BRICK_SPLATTER_TABLES
namespace pbm {

// How far a placed block of kEdge x kEdge pixels lies behind its plane one pixel from its middle, in voxel edges; the
// depth grows with the square of the distance.
template <int kEdge> inline constexpr float kPlacedBlockCone = kEdge == 2 ? 1.2F : 0.444F;

// Placed blocks of 3 x 3 pixels leave out pixels outside of an ellipse: those at (x, y) pixels from the middle where
//
//   x^2 + y^2 + kBlockTilt slope(x, y)^2 > (kBlockReach r)^2
//
// for a splat radius of r pixels; slope(x, y) is the depth of its plane there, in lengths of a pixel.
inline constexpr float kBlockTilt = 0.5F, kBlockReach = 1.25F;

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Blocks of kEdge x kEdge pixels. Four depths lie side by side: all of a block of 2 x 2 pixels, or a row of three and
// an unused one.
template <int kEdge> struct Blocks {
    static_assert(kEdge == 2 || kEdge == 3);
    static constexpr std::size_t kParts = kEdge == 2 ? 1 : 3;
    using Part = std::array<float, 4 * FacingPoints::kCapacity>;
    alignas(64) std::array<std::int32_t, FacingPoints::kCapacity> offset; // of the upper left pixel
    alignas(64) std::array<Part, kParts> depths;
};

// Draws three or four pixels.
template <std::size_t kPixels>
HWY_INLINE void draw_part(const float *depths, std::uint32_t id, const std::array<double *, kPixels> &to) {
#if HWY_TARGET == HWY_SCALAR
    for (std::size_t i = 0; i < kPixels; ++i)
        *to[i] = std::min(*to[i], DepthStrip::pixel(depths[i], id));
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
    const auto draw = [&](auto value, double *at) {
        hn::StoreU(lesser_doubles(value, hn::LoadU(pixel, at)), pixel, at);
    };
    draw(hn::LowerHalf(first), to[0]);
    draw(hn::UpperHalf(pixel, first), to[1]);
    draw(hn::LowerHalf(second), to[2]);
    if constexpr (kPixels == 4)
        draw(hn::UpperHalf(pixel, second), to[3]);
#endif
}

// Draws block number `i`. `upper`: its upper left pixel.
template <int kEdge>
HWY_INLINE void draw_block(const Blocks<kEdge> &blocks, std::size_t i, std::uint32_t id, double *upper,
                           std::ptrdiff_t stride) {
    if constexpr (kEdge == 2) {
        draw_part<4>(blocks.depths[0].data() + 4 * i, id, {upper, upper + 1, upper + stride, upper + stride + 1});
    } else {
        for (const auto &row : blocks.depths) {
            draw_part<3>(row.data() + 4 * i, id, {upper, upper + 1, upper + 2});
            upper += stride;
        }
    }
}

// Computes the blocks of a vector of points from `first` on. Lanes behind the last point get unused blocks. kBacks:
// returns a bit for each block that is as near at a pixel as what is drawn there; others need not be computed.
template <int kEdge, bool kPlaced, bool kBacks>
HWY_INLINE unsigned project_blocks(const StripRun &at, const FacingPoints &points, std::size_t first,
                                   Blocks<kEdge> &blocks) {
    const FrameGeometry &frame = at.frame;
    const DepthStrip &strip = at.strip;
    const float voxel_edge = at.run.voxel;
    const std::size_t end = points.count;
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector half = set(0.5F), one = set(1);
    const ProjectedSplats s = project_splats<kPlaced>(
        frame, voxel_edge, kPlaced ? kPlacedBlockOutlineInset : kBlockOutlineInset, points, first);
    const SplatNormal &n = s.normal;
    const Vector inverse = hn::Div(one, hn::Mul(s.pixel_size, s.cosine)); // one division for two
    const Vector inverse_cosine = hn::Mul(inverse, s.pixel_size);
    const Vector outline_pixels = hn::Mul(s.outline, hn::Mul(inverse, s.cosine));
    const Vector at_x = hn::Sub(hn::Load(d, points.x.data() + first), hn::Mul(outline_pixels, s.image_x));
    const Vector at_y = hn::Sub(hn::Load(d, points.y.data() + first), hn::Mul(outline_pixels, s.image_y));
    const float steepest = kPlaced ? kPlacedSteepest : kSteepest;
    const Vector plane_x = plane_slope(n.x, inverse_cosine, steepest),
                 plane_y = plane_slope(n.y, inverse_cosine, steepest);
    const Vector at_z = depth_in_middle(s, hn::Load(d, points.w.data() + first), plane_x, plane_y);
    const Vector slope_x = hn::Mul(plane_x, s.pixel_size), slope_y = hn::Mul(plane_y, s.pixel_size);

    // The pixels whose centres are nearest to the point. A block outside of the strip is drawn to an unused place.
    const Vector to_first = set((kEdge - 1) / 2.0F);
    const auto within = [&](Vector v, int from, int to) {
        return hn::And(hn::Ge(v, set(static_cast<float>(from))), hn::Lt(v, set(static_cast<float>(to))));
    };
    const Vector column = hn::Floor(hn::Sub(at_x, to_first)), row = hn::Floor(hn::Sub(at_y, to_first));
    const Mask visible = hn::And(hn::FirstN(d, end - first), hn::And(within(column, 1 - kEdge, strip.width),
                                                                     within(row, strip.top + 1 - kEdge, strip.bottom)));
    const auto offset =
        hn::Add(hn::Add(hn::ConvertTo(di, column), hn::Set(di, DepthStrip::kMarginLeft)),
                hn::Mul(hn::Sub(hn::ConvertTo(di, row), hn::Set(di, strip.top - DepthStrip::kMarginRows)),
                        hn::Set(di, strip.stride)));
    const IntVector used = hn::IfThenElse(hn::RebindMask(di, visible), offset, hn::Set(di, strip.unseen()));
    // From the middle of the splat to the centres of the pixels.
    const Vector left = hn::Sub(hn::Add(column, half), at_x), upper = hn::Sub(hn::Add(row, half), at_y);
    std::array<std::array<Vector, kEdge>, kEdge> depths; // [row][column]
    depths[0][0] = hn::Add(at_z, hn::Add(hn::Mul(slope_x, left), hn::Mul(slope_y, upper)));
    for (std::size_t x = 1; x < kEdge; ++x)
        depths[0][x] = hn::Add(depths[0][x - 1], slope_x);
    for (std::size_t y = 1; y < kEdge; ++y)
        for (std::size_t x = 0; x < kEdge; ++x)
            depths[y][x] = hn::Add(depths[y - 1][x], slope_y);
    std::array<Vector, kEdge> from_x, from_y; // of the pixels' centres from the middle
    for (std::size_t i = 0; i < kEdge; ++i) {
        from_x[i] = hn::Add(left, set(static_cast<float>(i)));
        from_y[i] = hn::Add(upper, set(static_cast<float>(i)));
    }
    constexpr bool kIsCut = kPlaced && kEdge == 3;
    const Vector cone = set(kPlacedBlockCone<kEdge> * voxel_edge);
    Vector reach2 = hn::Zero(d);
    if constexpr (kIsCut) {
        const Vector radius = hn::Load(d, points.radius.data() + first);
        const Vector reach = hn::Mul(hn::Mul(set(kBlockReach), radius), hn::Mul(inverse, s.cosine));
        reach2 = hn::Mul(reach, reach);
    }
    for (std::size_t y = 0; y < kEdge; ++y)
        for (std::size_t x = 0; x < kEdge; ++x) {
            Vector form = hn::Add(hn::Mul(from_x[x], from_x[x]), hn::Mul(from_y[y], from_y[y]));
            if constexpr (kIsCut) {
                const Vector slope = hn::Add(hn::Mul(plane_x, from_x[x]), hn::Mul(plane_y, from_y[y]));
                form = hn::Add(form, hn::Mul(set(kBlockTilt), hn::Mul(slope, slope)));
            }
            Vector &depth = depths[y][x];
            if constexpr (kPlaced)
                depth = hn::Add(depth, hn::Mul(cone, form));
            if constexpr (kIsCut)
                depth = hn::IfThenElse(hn::Le(form, reach2), depth, set(std::numeric_limits<float>::infinity()));
        }
    Mask nearer = visible;
    if constexpr (kBacks) {
        // The upper halves of the pixels are depths.
        const auto *const drawn = reinterpret_cast<const float *>(strip.pixels.data()) + 1;
        Mask any = hn::FirstN(d, 0);
        for (std::size_t y = 0; y < kEdge; ++y)
            for (std::size_t x = 0; x < kEdge; ++x) {
                const auto to_pixel = static_cast<std::int32_t>(y) * strip.stride + static_cast<std::int32_t>(x);
                const IntVector pixel = hn::ShiftLeft<1>(hn::Add(used, hn::Set(di, to_pixel)));
                any = hn::Or(any, hn::Le(depths[y][x], hn::GatherIndex(d, drawn, pixel)));
            }
        nearer = hn::And(nearer, any);
        if (hn::AllFalse(d, nearer))
            return 0;
    }
    hn::Store(used, di, blocks.offset.data() + first);
    if constexpr (kEdge == 2)
        hn::StoreInterleaved4(depths[0][0], depths[0][1], depths[1][0], depths[1][1], d,
                              blocks.depths[0].data() + 4 * first);
    else
        for (std::size_t y = 0; y < kEdge; ++y)
            hn::StoreInterleaved4(depths[y][0], depths[y][1], depths[y][2], depths[y][2], d,
                                  blocks.depths[y].data() + 4 * first);
    return kBacks ? mask_bits(nearer) : 0;
}

// Draws all points as blocks. All blocks are computed before the first is drawn, so that latencies overlap.
template <bool kPlaced, int kEdge>
HWY_INLINE void draw_blocks(const StripRun &at, Blocks<kEdge> &blocks, FacingPoints &points, DepthStrip &strip) {
    for (std::size_t i = 0; i < points.count; i += hn::Lanes(Floats()))
        project_blocks<kEdge, kPlaced, false>(at, points, i, blocks);
    for (std::size_t i = 0; i < points.count; ++i)
        draw_block(blocks, i, static_cast<std::uint32_t>(points.id[i]), strip.pixels.data() + blocks.offset[i],
                   strip.stride);
    points.count = 0;
}

// The same for backs: most of them are hidden.
template <bool kPlaced, int kEdge>
HWY_INLINE void draw_back_blocks(const StripRun &at, Blocks<kEdge> &blocks, FacingPoints &points, DepthStrip &strip) {
    for (std::size_t first = 0; first < points.count; first += hn::Lanes(Floats()))
        for (unsigned bits = project_blocks<kEdge, kPlaced, true>(at, points, first, blocks); bits != 0;
             bits &= bits - 1) {
            const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(bits));
            draw_block(blocks, i, static_cast<std::uint32_t>(points.id[i]), strip.pixels.data() + blocks.offset[i],
                       strip.stride);
        }
    points.count = 0;
}

// Draws all points as ellipses, whatever their size.
template <bool kPlaced> HWY_NOINLINE void draw_ellipses(const StripRun &at, FacingPoints &points, DepthStrip &strip) {
    draw_near(points.near, at.frame, strip);
    points.near.clear();
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
HWY_INLINE bool is_hidden(const VisibleBrick &it, const DepthStrip &strip) {
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

// Memory for points that wait until there are many to draw at once.
struct SplatScratch {
    Blocks<2> small_blocks;
    Blocks<3> blocks;
    FacingPoints small, middling, large;
};

// Draws points of bricks of one kind, see VisibleBrick::block. There are enough of them to make up for the call.
template <bool kPlaced>
HWY_NOINLINE void draw_points(const StripRun &at, int block, SplatScratch &scratch, FacingPoints &points,
                              DepthStrip &strip) {
    if (block == 0)
        draw_ellipses<kPlaced>(at, points, strip);
    else if (block == 2)
        draw_blocks<kPlaced>(at, scratch.small_blocks, points, strip);
    else
        draw_blocks<kPlaced>(at, scratch.blocks, points, strip);
}

template <bool kPlaced>
HWY_INLINE void draw_backs(const StripRun &at, int block, SplatScratch &scratch, FacingPoints &points,
                           DepthStrip &strip) {
    if (block == 0)
        draw_ellipses<kPlaced>(at, points, strip);
    else if (block == 2)
        draw_back_blocks<kPlaced>(at, scratch.small_blocks, points, strip);
    else
        draw_back_blocks<kPlaced>(at, scratch.blocks, points, strip);
}

// Draws the backs that wait.
void draw_waiting(const FrameGeometry &frame, SplatScratch &scratch, WaitingBacks &waiting, DepthStrip &strip) {
    for (const std::unique_ptr<WaitingBacks::Group> &group : waiting.groups()) {
        const StripRun at{frame, *group->run, strip};
        if (group->run->run->offsets != nullptr)
            draw_backs<true>(at, group->block, scratch, group->points, strip);
        else
            draw_backs<false>(at, group->block, scratch, group->points, strip);
    }
    waiting.clear();
}

template <int kBlock, bool kPlaced>
HWY_INLINE std::size_t add_brick_of_kind(const StripRun &at, const VisibleBrick &it, std::uint32_t first_id,
                                         const BothSides &to) {
    return it.has_backs ? add_brick_with_backs<kBlock, kPlaced>(at, it, first_id, to)
                        : add_brick<kBlock, kPlaced, false>(at, it, first_id, to);
}

// Draws bricks of one run, all of backs or none. Their backs wait.
template <bool kPlaced>
HWY_INLINE std::uint64_t draw_all(const StripRun &at, std::span<const VisibleBrick> seen,
                                  std::span<const StripBricks::Brick> bricks, std::uint32_t first_id,
                                  SplatScratch &scratch, DepthStrip &strip, BackScratch &backs) {
    const bool only_backs = bricks.front().only_backs;
    std::uint64_t drawn = 0;
    for (const StripBricks::Brick &brick : bricks) {
        const VisibleBrick &it = seen[brick.seen];
        if ((only_backs && backs.farthest.hide(it)) || is_hidden(it, strip))
            continue;
        FacingPoints *const waiting = it.has_backs ? &backs.waiting.group_of(at.run, it.block).points : nullptr;
        FacingPoints &fronts = it.block == 0 ? scratch.large : it.block == 2 ? scratch.small : scratch.middling;
        const BothSides to{only_backs ? nullptr : &fronts, waiting};
        if (it.block == 0)
            drawn += add_brick_of_kind<0, kPlaced>(at, it, first_id, to);
        else if (it.block == 2)
            drawn += add_brick_of_kind<2, kPlaced>(at, it, first_id, to);
        else
            drawn += add_brick_of_kind<3, kPlaced>(at, it, first_id, to);
        if (fronts.count >= kWaiting)
            draw_points<kPlaced>(at, it.block, scratch, fronts, strip);
        if (only_backs && waiting->count >= kWaiting)
            draw_waiting(at.frame, scratch, backs.waiting, strip);
    }
    draw_points<kPlaced>(at, 0, scratch, scratch.large, strip);
    draw_points<kPlaced>(at, 2, scratch, scratch.small, strip);
    draw_points<kPlaced>(at, 3, scratch, scratch.middling, strip);
    return drawn;
}

std::uint64_t draw_bricks(const FrameGeometry &frame, const StripBricks &list, DepthStrip &strip, BackScratch &backs) {
    // On the heap, whose pages are large and of which strips share the same: a stack's pages are touched one by one.
    const std::unique_ptr<SplatScratch> memory(new SplatScratch);
    SplatScratch &scratch = *memory;
    std::uint64_t drawn = 0;
    bool fronts_are_drawn = false;
    backs.waiting.clear();
    for (std::span<const StripBricks::Brick> left = list.bricks(); !left.empty();) {
        const auto [number, seen, only_backs] = left.front();
        if (only_backs && !std::exchange(fronts_are_drawn, true)) {
            backs.farthest.begin(strip);
            draw_waiting(frame, scratch, backs.waiting, strip);
        }
        // clang 14 captures no structured bindings.
        const auto is_other = [run = number, backs_alone = only_backs](const StripBricks::Brick &brick) {
            return brick.run != run || brick.only_backs != backs_alone;
        };
        const auto other = std::find_if(left.begin(), left.end(), is_other);
        const auto of_run = left.first(static_cast<std::size_t>(other - left.begin()));
        left = left.subspan(of_run.size());
        const StripBricks::Run &run = list.run(number);
        const StripRun at{frame, *run.geometry, strip};
        drawn += run.geometry->run->offsets != nullptr
                     ? draw_all<true>(at, run.seen, of_run, run.first_id, scratch, strip, backs)
                     : draw_all<false>(at, run.seen, of_run, run.first_id, scratch, strip, backs);
    }
    draw_waiting(frame, scratch, backs.waiting, strip);
    return drawn;
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_bricks);

std::uint64_t draw_bricks(const FrameGeometry &frame, const StripBricks &bricks, DepthStrip &strip,
                          BackScratch &backs) {
    return HWY_DYNAMIC_DISPATCH(draw_bricks)(frame, bricks, strip, backs);
}

} // namespace pbm
#endif // HWY_ONCE
