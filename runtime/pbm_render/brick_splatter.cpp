#include "pbm_render/brick_splatter.h"

#include "pbm_render/splat.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/brick_splatter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/packing.h"

#ifndef PBM_RENDER_BRICK_SPLATTER_TABLES
#define PBM_RENDER_BRICK_SPLATTER_TABLES
namespace pbm {

// Place of a voxel in its brick: x + 16 y + 256 z, each 0..7.
using VoxelPlace = std::uint16_t;

constexpr VoxelPlace voxel_place(std::size_t morton) {
    std::uint32_t place = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t bit = 0; bit < 3; ++bit)
            place |= static_cast<std::uint32_t>(morton >> (3 * bit + axis) & 1) << (4 * axis + bit);
    return static_cast<VoxelPlace>(place);
}

// Places of the children that a mask announces, in order, beside each other: [mask][8].
inline constexpr std::array<std::array<VoxelPlace, 8>, 256> kChildPlaces = [] {
    std::array<std::array<VoxelPlace, 8>, 256> places{};
    for (std::size_t mask = 0; mask < 256; ++mask) {
        std::size_t n = 0;
        for (std::size_t child = 0; child < 8; ++child)
            if ((mask >> child & 1) != 0)
                places[mask][n++] = voxel_place(child);
    }
    return places;
}();

// Place of the first child of each of a brick's 64 nodes.
inline constexpr std::array<VoxelPlace, 64> kNodePlaces = [] {
    std::array<VoxelPlace, 64> places{};
    for (std::size_t node = 0; node < 64; ++node)
        places[node] = voxel_place(8 * node);
    return places;
}();

// kOutlineInset of blocks, which reach farther than the ellipses they stand for.
inline constexpr float kBlockOutlineInset = 0.6F;

inline constexpr std::size_t kMostLanes = 16;
inline constexpr std::size_t kBrickPoints = 512;

// From a stored normal to kPackedTwoSided.
inline constexpr int kTwoSidedShift = std::countr_zero(kTwoSidedBit);

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The points of a brick: where they are in it, filled up to whole SIMD vectors.
struct BrickPlaces {
    alignas(64) std::array<VoxelPlace, kBrickPoints + kMostLanes> place;
};

// Writes the places of all points of a brick; returns their number.
HWY_INLINE std::size_t list_places(const BrickRecord &brick, ByteView masks, BrickPlaces &to) {
    if (brick.first_node >= masks.size())
        return 0;
    const std::uint8_t *mask = masks.data() + brick.first_node;
    const std::uint8_t *const end = masks.data() + masks.size();
    std::size_t count = 0;
    for (std::uint64_t map = brick.node_map; map != 0 && mask != end; map &= map - 1, ++mask) {
        const VoxelPlace node = kNodePlaces[static_cast<std::size_t>(std::countr_zero(map))];
        const std::array<VoxelPlace, 8> &children = kChildPlaces[*mask];
#if HWY_TARGET == HWY_SCALAR
        for (std::size_t i = 0; i < children.size(); ++i)
            to.place[count + i] = node | children[i];
#else
        const hn::FixedTag<VoxelPlace, 8> d;
        hn::StoreU(hn::Or(hn::Set(d, node), hn::LoadU(d, children.data())), d, to.place.data() + count);
#endif
        count += kChildren[*mask];
    }
    return count;
}

// Points that face the eye, side by side: bricks differ in size, SIMD vectors do not.
inline constexpr std::size_t kWaiting = 512; // so many points are drawn at once
struct FacingPoints {
    static constexpr std::size_t kCapacity = kWaiting + kBrickPoints + kMostLanes;
    std::size_t count = 0;
    alignas(64) std::array<float, kCapacity> x, y, w;       // pixel and depth
    alignas(64) std::array<std::int32_t, kCapacity> normal; // packed; bit 0 says that it is two-sided
    alignas(64) std::array<std::int32_t, kCapacity> id;
    // Of large splats only:
    alignas(64) std::array<float, kCapacity> radius; // grid edges
    alignas(64) std::array<std::int32_t, kCapacity> normal_index;
};

// Blocks of 2 x 2 pixels: what small splats are drawn as.
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
    // Pixel by pixel: the block before often has one of them, and what was stored is only quickly read again in the
    // same pieces.
    const auto draw = [&](auto value, double *to) { hn::StoreU(hn::Min(value, hn::LoadU(pixel, to)), pixel, to); };
    draw(hn::LowerHalf(first), upper);
    draw(hn::UpperHalf(pixel, first), upper + 1);
    draw(hn::LowerHalf(second), lower);
    draw(hn::UpperHalf(pixel, second), lower + 1);
#endif
}

// A normal as the eye sees it, turned towards it if it is two-sided, at a point on the screen.
struct SeenNormal {
    Vector x, y, z;
    Vector ray_x, ray_y; // from the eye through the point, depth 1
    Vector facing;       // cosine between normal and ray, times the ray's length
    Mask two_sided;
};

HWY_INLINE SeenNormal see_normal(const FrameGeometry &frame, IntVector packed, Vector pixel_x, Vector pixel_y) {
    const Floats d;
    const Ints di;
    const Vector scale = hn::Set(d, 1 / kPackedNormalScale), inverse_focal = hn::Set(d, frame.inverse_focal);
    SeenNormal n;
    n.x = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<23>(packed)), scale);
    n.y = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<23>(hn::ShiftLeft<9>(packed))), scale);
    n.z = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<23>(hn::ShiftLeft<18>(packed))), scale);
    n.ray_x = hn::Mul(hn::Sub(pixel_x, hn::Set(d, frame.middle_x)), inverse_focal);
    n.ray_y = hn::Mul(hn::Sub(pixel_y, hn::Set(d, frame.middle_y)), inverse_focal);
    const Vector facing = hn::Add(hn::Add(hn::Mul(n.x, n.ray_x), hn::Mul(n.y, n.ray_y)), n.z);
    n.two_sided = hn::RebindMask(d, hn::TestBit(packed, hn::Set(di, kPackedTwoSided)));
    const Vector turn = hn::IfThenElseZero(n.two_sided, hn::AndNot(facing, hn::SignBit(d)));
    n.x = hn::Xor(n.x, turn);
    n.y = hn::Xor(n.y, turn);
    n.z = hn::Xor(n.z, turn);
    n.facing = hn::Xor(facing, turn);
    return n;
}

// Points as splat.h lays splats, a vector of them: what blocks and ellipses have in common.
struct LaidSplats {
    SeenNormal normal;
    Vector image_x, image_y; // image of the normal, for focal length and depth 1
    Vector pixel_size;       // in the depth of the point
    Vector cosine;           // of the angle under which the plane is seen
    Vector outline, inset;   // grid edges
};

HWY_INLINE LaidSplats lay_splats(const FrameGeometry &frame, float voxel_edge, float outline_inset,
                                 const FacingPoints &points, std::size_t first) {
    const Floats d;
    const Ints di;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1);
    const auto clamp_to_one = [&](Vector v) { return hn::Min(hn::Max(v, zero), one); };
    const IntVector packed = hn::Load(di, points.normal.data() + first);
    LaidSplats s;
    s.normal = see_normal(frame, packed, hn::Load(d, points.x.data() + first), hn::Load(d, points.y.data() + first));
    const SeenNormal &n = s.normal;
    const Vector voxel = hn::IfThenZeroElse(n.two_sided, hn::Set(d, voxel_edge));
    s.outline = hn::Mul(hn::Mul(voxel, hn::Set(d, outline_inset)),
                        clamp_to_one(hn::Add(one, hn::Mul(hn::Set(d, kOutlineSlope), n.facing))));
    const Vector edge_on = clamp_to_one(hn::Add(one, n.facing)), edge_on2 = hn::Mul(edge_on, edge_on);
    const Vector mean_inset =
        hn::Mul(hn::ConvertTo(d, hn::And(packed, hn::Set(di, kPackedInsetMask))), hn::Set(d, 1 / kPackedInsetScale));
    s.inset = hn::Mul(voxel, hn::Add(mean_inset, hn::Mul(hn::Set(d, kGrazingInset), hn::Mul(edge_on2, edge_on2))));
    s.image_x = hn::Sub(n.x, hn::Mul(n.ray_x, n.z));
    s.image_y = hn::Sub(n.y, hn::Mul(n.ray_y, n.z));
    s.pixel_size = hn::Mul(hn::Load(d, points.w.data() + first), hn::Set(d, frame.inverse_focal));
    s.cosine = hn::Max(hn::Neg(n.facing), hn::Set(d, kEdgeOn));
    return s;
}

// Depth of the plane, of the given slopes per unit of depth 1, in the middle of the splat.
HWY_INLINE Vector depth_in_middle(const LaidSplats &s, Vector w, Vector slope_x, Vector slope_y) {
    const Vector along = hn::Add(hn::Mul(slope_x, s.image_x), hn::Mul(slope_y, s.image_y));
    return hn::Add(w, hn::Sub(hn::Mul(along, hn::Sub(s.inset, s.outline)), hn::Mul(s.inset, s.normal.z)));
}

// Lays the blocks of a vector of points; those from `end` on are seen nowhere.
HWY_INLINE void lay_blocks(const FrameGeometry &frame, float voxel_edge, const FacingPoints &points, std::size_t first,
                           std::size_t end, const DepthStrip &strip, Blocks &blocks) {
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector half = set(0.5F);
    const LaidSplats s = lay_splats(frame, voxel_edge, kBlockOutlineInset, points, first);
    const SeenNormal &n = s.normal;
    const Vector inverse = hn::Div(set(1), hn::Mul(s.pixel_size, s.cosine)); // one division for two
    const Vector inverse_cosine = hn::Mul(inverse, s.pixel_size);
    const Vector outline_pixels = hn::Mul(s.outline, hn::Mul(inverse, s.cosine));
    const Vector at_x = hn::Sub(hn::Load(d, points.x.data() + first), hn::Mul(outline_pixels, s.image_x));
    const Vector at_y = hn::Sub(hn::Load(d, points.y.data() + first), hn::Mul(outline_pixels, s.image_y));
    // Never farther from the middle's depth than a splat of this size reaches.
    const Vector most = set(kBlockRadius), least = set(-kBlockRadius);
    const Vector plane_x = hn::Min(hn::Max(hn::Mul(n.x, inverse_cosine), least), most);
    const Vector plane_y = hn::Min(hn::Max(hn::Mul(n.y, inverse_cosine), least), most);
    const Vector at_z = depth_in_middle(s, hn::Load(d, points.w.data() + first), plane_x, plane_y);
    const Vector slope_x = hn::Mul(plane_x, s.pixel_size), slope_y = hn::Mul(plane_y, s.pixel_size);

    // The block whose pixels' centres lie around the point; what is not in the strip goes where nobody looks.
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
    const Vector depth = hn::Add(at_z, hn::Add(hn::Mul(slope_x, hn::Sub(hn::Add(column, half), at_x)),
                                               hn::Mul(slope_y, hn::Sub(hn::Add(row, half), at_y))));
    const Vector right = hn::Add(depth, slope_x);
    hn::StoreInterleaved4(depth, right, hn::Add(depth, slope_y), hn::Add(right, slope_y), d,
                          blocks.depths.data() + 4 * first);
}

// Draws all points as blocks. They are laid before the first is drawn: so many steps that wait for each other do so
// together.
HWY_INLINE void draw_blocks(const FrameGeometry &frame, float voxel, Blocks &blocks, FacingPoints &points,
                            DepthStrip &strip) {
    for (std::size_t i = 0; i < points.count; i += hn::Lanes(Floats()))
        lay_blocks(frame, voxel, points, i, points.count, strip, blocks);
    for (std::size_t i = 0; i < points.count; ++i)
        draw_block(blocks.depths.data() + 4 * i, static_cast<std::uint32_t>(points.id[i]),
                   strip.pixels.data() + blocks.offset[i], strip.stride);
    points.count = 0;
}

// As SplatShape, for the depth where the point is: a vector of splats of any size.
struct Ellipses {
    alignas(64) std::array<float, kMostLanes> x, y, depth;                     // middle
    alignas(64) std::array<float, kMostLanes> xx, xy, yy;                      // 1 on the outline
    alignas(64) std::array<float, kMostLanes> slope_x, slope_y;                // of the depth, per pixel
    alignas(64) std::array<std::int32_t, kMostLanes> left, right, top, bottom; // pixels, in the strip
};

// lay_splat for a vector of points; those from `end` on are seen nowhere.
HWY_INLINE void lay_ellipses(const FrameGeometry &frame, float voxel_edge, const FacingPoints &points,
                             std::size_t first, std::size_t end, const DepthStrip &strip, Ellipses &to) {
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector one = set(1), half = set(0.5F);
    const LaidSplats s = lay_splats(frame, voxel_edge, kOutlineInset, points, first);
    const SeenNormal &n = s.normal;
    const Vector radius = hn::Load(d, points.radius.data() + first);
    // Behind the last point anything may stand, but no index of nothing.
    const IntVector normal = hn::And(hn::Load(di, points.normal_index.data() + first), hn::Set(di, kNormalIndexMask));
    const Vector thickness = hn::Mul(set(voxel_edge), hn::GatherIndex(d, frame.thickness.data(), normal));

    // r^2 I - (r^2 - t^2) n n^T through the Jacobian of the projection, for focal length and depth 1.
    const Vector r2 = hn::Mul(radius, radius);
    const Vector flat = hn::Max(hn::Sub(r2, hn::Mul(thickness, thickness)), hn::Zero(d));
    const auto covariance = [&](Vector rays, Vector images) {
        return hn::Sub(hn::Mul(r2, rays), hn::Mul(flat, images));
    };
    const Vector xx = covariance(hn::Add(one, hn::Mul(n.ray_x, n.ray_x)), hn::Mul(s.image_x, s.image_x));
    const Vector xy = covariance(hn::Mul(n.ray_x, n.ray_y), hn::Mul(s.image_x, s.image_y));
    const Vector yy = covariance(hn::Add(one, hn::Mul(n.ray_y, n.ray_y)), hn::Mul(s.image_y, s.image_y));
    const Vector size2 = hn::Mul(s.pixel_size, s.pixel_size);
    const Vector inverse = hn::Div(size2, hn::Sub(hn::Mul(xx, yy), hn::Mul(xy, xy)));
    hn::Store(hn::Mul(yy, inverse), d, to.xx.data());
    hn::Store(hn::Mul(hn::Mul(set(-2), xy), inverse), d, to.xy.data());
    hn::Store(hn::Mul(xx, inverse), d, to.yy.data());

    // Depth along the plane, but never farther from the middle's than the disc itself reaches.
    Vector plane_x = hn::Div(n.x, s.cosine), plane_y = hn::Div(n.y, s.cosine);
    const Vector rise =
        hn::Sqrt(hn::Add(hn::Mul(plane_x, hn::Add(hn::Mul(xx, plane_x), hn::Mul(hn::Mul(set(2), xy), plane_y))),
                         hn::Mul(hn::Mul(yy, plane_y), plane_y)));
    const Vector most = hn::Min(one, hn::Div(radius, hn::Max(rise, set(1e-20F))));
    plane_x = hn::Mul(plane_x, most);
    plane_y = hn::Mul(plane_y, most);
    hn::Store(hn::Mul(plane_x, s.pixel_size), d, to.slope_x.data());
    hn::Store(hn::Mul(plane_y, s.pixel_size), d, to.slope_y.data());
    hn::Store(depth_in_middle(s, hn::Load(d, points.w.data() + first), plane_x, plane_y), d, to.depth.data());

    const Vector pixels = hn::Div(one, s.pixel_size);
    const auto place = [&](const float *at, Vector image, Vector variance, float from, float to_end, float *middle,
                           std::int32_t *begin, std::int32_t *finish) {
        const Vector centre = hn::Sub(hn::Load(d, at), hn::Mul(hn::Mul(s.outline, image), pixels));
        const Vector reach = hn::Mul(hn::Sqrt(variance), pixels);
        hn::Store(centre, d, middle);
        // Pixel i is inside if its centre i + 0.5 is: the first one is floor(edge + 0.5).
        const auto edge = [&](Vector v) {
            const Vector inside = hn::Floor(hn::Min(hn::Max(hn::Add(v, half), set(from)), set(to_end)));
            return hn::ConvertTo(di, hn::IfThenElseZero(hn::FirstN(d, end - first), inside));
        };
        hn::Store(edge(hn::Sub(centre, reach)), di, begin);
        hn::Store(edge(hn::Add(centre, reach)), di, finish);
    };
    place(points.x.data() + first, s.image_x, xx, 0, static_cast<float>(strip.width), to.x.data(), to.left.data(),
          to.right.data());
    place(points.y.data() + first, s.image_y, yy, static_cast<float>(strip.top), static_cast<float>(strip.bottom),
          to.y.data(), to.top.data(), to.bottom.data());
}

// Draws one splat: the pixels whose centres lie in the ellipse and that are nearer than what is there.
HWY_INLINE void draw_ellipse(const Ellipses &ellipses, std::size_t lane, std::uint32_t id, DepthStrip &strip) {
    const float xx = ellipses.xx[lane], xy = ellipses.xy[lane], yy = ellipses.yy[lane];
    const float slope_x = ellipses.slope_x[lane];
    const std::int32_t left = ellipses.left[lane], right = ellipses.right[lane];
    for (std::int32_t row = ellipses.top[lane]; row < ellipses.bottom[lane]; ++row) {
        const float y = static_cast<float>(row) + 0.5F - ellipses.y[lane];
        const float row_depth = ellipses.depth[lane] + ellipses.slope_y[lane] * y, row_xy = xy * y, row_yy = yy * y * y;
        double *const pixels = strip.pixels.data() + strip.offset(0, row);
        const float first_x = static_cast<float>(left) + 0.5F - ellipses.x[lane];
#if HWY_TARGET == HWY_SCALAR
        for (std::int32_t i = left; i < right; ++i) {
            const float x = first_x + static_cast<float>(i - left);
            if (x * (xx * x + row_xy) + row_yy <= 1)
                pixels[i] = std::min(pixels[i], DepthStrip::pixel(row_depth + slope_x * x, id));
        }
#else
        const hn::FixedTag<float, 4> d32;
        const hn::FixedTag<std::uint32_t, 4> du32;
        const hn::FixedTag<double, 2> d64;
        const auto four = hn::Set(d32, 4);
        const auto ids = hn::Set(du32, id);
        // Four pixels at once; those beside the box are outside the ellipse, too.
        auto x = hn::Add(hn::Set(d32, first_x), hn::Iota(d32, 0));
        for (std::int32_t i = left; i < right; i += 4, x = hn::Add(x, four)) {
            const auto inside = hn::Le(
                hn::Add(hn::Mul(x, hn::Add(hn::Mul(hn::Set(d32, xx), x), hn::Set(d32, row_xy))), hn::Set(d32, row_yy)),
                hn::Set(d32, 1));
            const auto depth = hn::Add(hn::Set(d32, row_depth), hn::Mul(hn::Set(d32, slope_x), x));
            const auto z =
                hn::BitCast(du32, hn::IfThenElse(inside, depth, hn::Set(d32, std::numeric_limits<float>::infinity())));
            const auto draw = [&](auto value, double *to) {
                hn::StoreU(hn::Min(hn::BitCast(d64, value), hn::LoadU(d64, to)), d64, to);
            };
            draw(hn::InterleaveLower(du32, ids, z), pixels + i);
            draw(hn::InterleaveUpper(du32, ids, z), pixels + i + 2);
        }
#endif
    }
}

// Draws all points, large and small, as the ellipses they are.
HWY_INLINE void draw_ellipses(const FrameGeometry &frame, float voxel, FacingPoints &points, DepthStrip &strip) {
    Ellipses ellipses;
    const std::size_t lanes = hn::Lanes(Floats());
    for (std::size_t i = 0; i < points.count; i += lanes) {
        lay_ellipses(frame, voxel, points, i, points.count, strip, ellipses);
        for (std::size_t lane = 0; lane < lanes; ++lane)
            if (ellipses.left[lane] < ellipses.right[lane] && ellipses.top[lane] < ellipses.bottom[lane])
                draw_ellipse(ellipses, lane, static_cast<std::uint32_t>(points.id[i + lane]), strip);
    }
    points.count = 0;
}

// A brick's points as they lie in the chunk: `available` of them may be read.
struct BrickStreams {
    const std::uint16_t *normals;
    const std::uint8_t *radii;
    std::size_t available;
};

// Projects the points begin .. end - 1 of a brick, whose places are known, and keeps those that face the eye and may
// touch the strip. Returns how many of them are at home in the strip, which is where their centres are.
template <bool kLarge>
HWY_INLINE std::size_t find_facing_points(const FrameGeometry &frame, const RunGeometry &geometry,
                                          const SeenBrick &brick, const BrickPlaces &places, std::size_t begin,
                                          std::size_t end, const BrickStreams &streams, std::uint32_t first_id,
                                          const DepthStrip &strip, FacingPoints &to) {
    const Floats d;
    const Ints di;
    const hn::Rebind<std::uint16_t, Floats> d16;
    const hn::Rebind<std::uint8_t, Floats> d8;
    const std::size_t lanes = hn::Lanes(d);
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto &[step_x, step_y, step_z] = geometry.steps;
    // Outlines are at most this much farther in than their points, rounding included: a voxel is at most 1.42 pixels.
    constexpr float kShift = 2;
    const Vector above = set(static_cast<float>(strip.top) - kShift),
                 below = set(static_cast<float>(strip.bottom) + kShift);
    constexpr float kNowhere = std::numeric_limits<float>::infinity();
    const Vector home_top = set(strip.top == 0 ? -kNowhere : static_cast<float>(strip.top));
    const Vector home_bottom = set(strip.bottom == frame.height ? kNowhere : static_cast<float>(strip.bottom));
    std::size_t at_home = 0, count = to.count;
    for (std::size_t i = begin; i < end; i += lanes) {
        const auto place = hn::PromoteTo(di, hn::LoadU(d16, places.place.data() + i));
        const Vector x = hn::ConvertTo(d, hn::And(place, hn::Set(di, 15)));
        const Vector y = hn::ConvertTo(d, hn::And(hn::ShiftRight<4>(place), hn::Set(di, 15)));
        const Vector z = hn::ConvertTo(d, hn::ShiftRight<8>(place));
        const auto project = [&](float base, float from_x, float from_y, float from_z) {
            return hn::Add(hn::Add(set(base), hn::Mul(x, set(from_x))),
                           hn::Add(hn::Mul(y, set(from_y)), hn::Mul(z, set(from_z))));
        };
        const Vector w = project(brick.w, step_x.z, step_y.z, step_z.z);
        const Vector inverse = hn::Div(set(1), w);
        const Vector pixel_x = hn::Mul(project(brick.u, step_x.x, step_y.x, step_z.x), inverse);
        const Vector pixel_y = hn::Mul(project(brick.v, step_x.y, step_y.y, step_z.y), inverse);

        auto stored = hn::Zero(di), radius_index = hn::Zero(di);
        if (i + lanes <= streams.available) {
            stored = hn::PromoteTo(di, hn::LoadU(d16, streams.normals + i));
            if constexpr (kLarge)
                radius_index = hn::PromoteTo(di, hn::LoadU(d8, streams.radii + i));
        } else { // the chunk's last points
            alignas(32) std::array<std::uint16_t, kMostLanes> last{};
            alignas(32) std::array<std::uint8_t, kMostLanes> last_radii{};
            std::copy_n(streams.normals + i, streams.available - i, last.begin());
            std::copy_n(streams.radii + i, streams.available - i, last_radii.begin());
            stored = hn::PromoteTo(di, hn::Load(d16, last.data()));
            radius_index = hn::PromoteTo(di, hn::Load(d8, last_radii.data()));
        }
        const auto side = hn::And(hn::ShiftRight<kTwoSidedShift>(stored), hn::Set(di, kPackedTwoSided));
        const IntVector index = hn::And(stored, hn::Set(di, kNormalIndexMask));
        const IntVector packed = hn::Or(hn::GatherIndex(di, frame.packed.data(), index), side);
        const Vector facing = see_normal(frame, packed, pixel_x, pixel_y).facing;
        Mask keep = hn::And(hn::Le(facing, set(kFacingSlack)), hn::FirstN(d, end - i));
        [[maybe_unused]] Vector radius = hn::Zero(d);
        if constexpr (kLarge) { // not those around the eye or behind it
            radius = hn::GatherIndex(d, frame.radii.data(), radius_index);
            keep = hn::And(keep, hn::Gt(w, hn::Mul(radius, set(kLeastDistance))));
        } else {
            keep = hn::And(keep, hn::And(hn::Gt(pixel_y, above), hn::Lt(pixel_y, below)));
        }
        const IntVector id = count_from(static_cast<std::int32_t>(first_id + i));
        const Packing pack(keep);
        hn::StoreU(pack(pixel_x), d, to.x.data() + count);
        hn::StoreU(pack(pixel_y), d, to.y.data() + count);
        hn::StoreU(pack(w), d, to.w.data() + count);
        hn::StoreU(pack(packed), di, to.normal.data() + count);
        hn::StoreU(pack(id), di, to.id.data() + count);
        if constexpr (kLarge) {
            hn::StoreU(pack(radius), d, to.radius.data() + count);
            hn::StoreU(pack(index), di, to.normal_index.data() + count);
        }
        count += hn::CountTrue(d, keep);
        at_home += hn::CountTrue(d, hn::And(keep, hn::And(hn::Ge(pixel_y, home_top), hn::Lt(pixel_y, home_bottom))));
    }
    to.count = count;
    return at_home;
}

std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &geometry, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip) {
    const PointRun &run = *geometry.run;
    const std::span<const std::uint16_t> normals = run.chunk->normals;
    const ByteView radii = run.chunk->radii;
    BrickPlaces places;
    Blocks blocks;
    FacingPoints small, large;
    std::uint64_t drawn = 0;
    for (const SeenBrick &it : seen) {
        if (it.top >= strip.bottom || it.bottom <= strip.top)
            continue;
        const BrickRecord brick = run.chunk->bricks[it.brick];
        const std::size_t first_point = brick.first_point;
        if (first_point >= normals.size())
            continue;
        const BrickStreams streams{normals.data() + first_point, radii.data() + first_point,
                                   normals.size() - first_point};
        const std::size_t count = std::min(list_places(brick, run.chunk->masks, places), streams.available);
        const std::size_t begin = run.first > first_point ? run.first - first_point : 0;
        const std::size_t end = run.last > first_point ? std::min<std::size_t>(count, run.last - first_point) : 0;
        const auto base_id = first_id + static_cast<std::uint32_t>(first_point);
        if (it.large) {
            drawn += find_facing_points<true>(frame, geometry, it, places, begin, end, streams, base_id, strip, large);
            if (large.count >= kWaiting)
                draw_ellipses(frame, geometry.voxel, large, strip);
        } else {
            drawn += find_facing_points<false>(frame, geometry, it, places, begin, end, streams, base_id, strip, small);
            if (small.count >= kWaiting)
                draw_blocks(frame, geometry.voxel, blocks, small, strip);
        }
    }
    draw_ellipses(frame, geometry.voxel, large, strip);
    draw_blocks(frame, geometry.voxel, blocks, small, strip);
    return drawn;
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_bricks);

std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip) {
    return HWY_DYNAMIC_DISPATCH(draw_bricks)(frame, run, seen, first_id, strip);
}

} // namespace pbm
#endif // HWY_ONCE
