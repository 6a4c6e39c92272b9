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

inline constexpr std::size_t kMostLanes = 16;
inline constexpr std::size_t kBrickPoints = 512;

// From a stored normal to kPackedTwoSided.
inline constexpr int kTwoSidedShift = std::countr_zero(kTwoSidedBit);

// A splat as wide as it is: all pixels of its ellipse in the strip. What draw_splat does for a framebuffer. Whether it
// was drawn.
bool draw_ellipse(const FrameGeometry &frame, const SplatSize &size, std::uint16_t normal, const glm::vec3 &image,
                  std::uint32_t id, DepthStrip &strip);

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
    alignas(64) std::array<float, kCapacity> x, y, w;      // pixel and depth
    alignas(64) std::array<std::int32_t, kCapacity> normal; // packed; bit 0 says that it is two-sided
    alignas(64) std::array<std::int32_t, kCapacity> id;
};

// Blocks of 2 x 2 pixels: what small splats are drawn as.
struct Blocks {
    alignas(64) std::array<std::int32_t, FacingPoints::kCapacity> offset; // of the upper left pixel
    alignas(64) std::array<float, 4 * FacingPoints::kCapacity> depths; // upper left and right, lower left and right
};

HWY_INLINE void draw_block(const float *depths, std::uint32_t id, double *upper, std::ptrdiff_t stride) {
    double *const lower = upper + stride;
#if HWY_TARGET == HWY_SCALAR
    const auto draw = [&](float depth, double *pixel) {
        const std::uint64_t bits = std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | id;
        *pixel = std::min(*pixel, std::bit_cast<double>(bits));
    };
    draw(depths[0], upper);
    draw(depths[1], upper + 1);
    draw(depths[2], lower);
    draw(depths[3], lower + 1);
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

// Lays the blocks of a vector of points; those from `end` on are seen nowhere.
HWY_INLINE void lay_blocks(const FrameGeometry &frame, float voxel_edge, const FacingPoints &points, std::size_t first,
                           std::size_t end, const DepthStrip &strip, Blocks &blocks) {
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector zero = hn::Zero(d), half = set(0.5F), one = set(1);
    const auto clamp_to_one = [&](Vector v) { return hn::Min(hn::Max(v, zero), one); };
    const Vector pixel_x = hn::Load(d, points.x.data() + first), pixel_y = hn::Load(d, points.y.data() + first);
    const Vector w = hn::Load(d, points.w.data() + first);
    const auto packed = hn::Load(di, points.normal.data() + first);
    const SeenNormal n = see_normal(frame, packed, pixel_x, pixel_y);

    // As lay_splat.
    const Vector voxel = hn::IfThenZeroElse(n.two_sided, set(voxel_edge));
    const Vector outline =
        hn::Mul(hn::Mul(voxel, set(kOutlineInset)), clamp_to_one(hn::Add(one, hn::Mul(set(1.4F), n.facing))));
    const Vector edge_on = clamp_to_one(hn::Add(one, n.facing)), edge_on2 = hn::Mul(edge_on, edge_on);
    const Vector mean_inset =
        hn::Mul(hn::ConvertTo(d, hn::And(packed, hn::Set(di, kPackedInsetMask))), set(1 / kPackedInsetScale));
    const Vector inset =
        hn::Mul(voxel, hn::Add(mean_inset, hn::Mul(set(kGrazingInset), hn::Mul(edge_on2, edge_on2))));
    const Vector image_x = hn::Sub(n.x, hn::Mul(n.ray_x, n.z)), image_y = hn::Sub(n.y, hn::Mul(n.ray_y, n.z));
    const Vector inverse_cosine = hn::Div(one, hn::Max(hn::Neg(n.facing), set(kEdgeOn)));
    const Vector pixel_size = hn::Mul(w, set(frame.inverse_focal));
    const Vector outline_pixels = hn::Div(outline, pixel_size);
    const Vector at_x = hn::Sub(pixel_x, hn::Mul(outline_pixels, image_x));
    const Vector at_y = hn::Sub(pixel_y, hn::Mul(outline_pixels, image_y));
    const Vector along = hn::Mul(hn::Add(hn::Mul(n.x, image_x), hn::Mul(n.y, image_y)), inverse_cosine);
    const Vector at_z = hn::Add(w, hn::Sub(hn::Mul(along, hn::Sub(inset, outline)), hn::Mul(inset, n.z)));
    const Vector most = hn::Mul(pixel_size, set(kBlockRadius)), least = hn::Neg(most);
    const Vector per_pixel = hn::Mul(pixel_size, inverse_cosine);
    const Vector slope_x = hn::Min(hn::Max(hn::Mul(n.x, per_pixel), least), most);
    const Vector slope_y = hn::Min(hn::Max(hn::Mul(n.y, per_pixel), least), most);

    // The block whose pixels' centres lie around the point; what is not in the strip goes where nobody looks.
    const auto within = [&](Vector v, float from, float to) {
        return hn::And(hn::Ge(v, set(from)), hn::Lt(v, set(to)));
    };
    const Vector column = hn::Floor(hn::Sub(at_x, half)), row = hn::Floor(hn::Sub(at_y, half));
    const auto visible = hn::And(hn::FirstN(d, end - first),
                                 hn::And(within(column, -1, static_cast<float>(strip.width)),
                                         within(row, static_cast<float>(strip.top - 1), static_cast<float>(strip.bottom))));
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

// Projects the points begin .. end - 1 of a brick, whose places are known, and keeps those that face the eye and may
// touch the strip. `available`: points of the chunk from the brick's first on.
HWY_INLINE void find_facing_points(const FrameGeometry &frame, const RunGeometry &geometry, const SeenBrick &brick,
                                   const BrickPlaces &places, std::size_t begin, std::size_t end,
                                   const std::uint16_t *normals, std::size_t available, std::uint32_t first_id,
                                   const DepthStrip &strip, FacingPoints &to) {
    const Floats d;
    const Ints di;
    const hn::Rebind<std::uint16_t, Floats> d16;
    const std::size_t lanes = hn::Lanes(d);
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto &[step_x, step_y, step_z] = geometry.steps;
    // Outlines are at most this much farther in than their points, rounding included: a voxel is at most 1.42 pixels.
    constexpr float kShift = 2;
    const Vector above = set(static_cast<float>(strip.top) - kShift), below = set(static_cast<float>(strip.bottom) + kShift);
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

        auto stored = hn::Zero(di);
        if (i + lanes <= available) {
            stored = hn::PromoteTo(di, hn::LoadU(d16, normals + i));
        } else { // the chunk's last points
            alignas(32) std::array<std::uint16_t, kMostLanes> last{};
            std::copy_n(normals + i, available - i, last.begin());
            stored = hn::PromoteTo(di, hn::Load(d16, last.data()));
        }
        const auto side = hn::And(hn::ShiftRight<kTwoSidedShift>(stored), hn::Set(di, kPackedTwoSided));
        const auto packed =
            hn::Or(hn::GatherIndex(di, frame.packed.data(), hn::And(stored, hn::Set(di, kNormalIndexMask))), side);
        const Vector facing = see_normal(frame, packed, pixel_x, pixel_y).facing;
        const auto keep = hn::And(hn::And(hn::Le(facing, set(kFacingSlack)), hn::FirstN(d, end - i)),
                                  hn::And(hn::Gt(pixel_y, above), hn::Lt(pixel_y, below)));
        const auto id = hn::Iota(di, static_cast<std::int32_t>(first_id + i));
        const Packing pack(keep);
        hn::StoreU(pack(pixel_x), d, to.x.data() + to.count);
        hn::StoreU(pack(pixel_y), d, to.y.data() + to.count);
        hn::StoreU(pack(w), d, to.w.data() + to.count);
        hn::StoreU(pack(packed), di, to.normal.data() + to.count);
        hn::StoreU(pack(id), di, to.id.data() + to.count);
        to.count += hn::CountTrue(d, keep);
    }
}

// Draws all points. Blocks are laid before the first is drawn: so many steps that wait for each other do so together.
HWY_INLINE void draw_points(const FrameGeometry &frame, float voxel, Blocks &blocks, FacingPoints &points,
                            DepthStrip &strip) {
    for (std::size_t i = 0; i < points.count; i += hn::Lanes(Floats()))
        lay_blocks(frame, voxel, points, i, points.count, strip, blocks);
    for (std::size_t i = 0; i < points.count; ++i)
        draw_block(blocks.depths.data() + 4 * i, static_cast<std::uint32_t>(points.id[i]),
                   strip.pixels.data() + blocks.offset[i], strip.stride);
    points.count = 0;
}

std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &geometry, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip) {
    const PointRun &run = *geometry.run;
    const std::span<const std::uint16_t> normals = run.chunk->normals;
    BrickPlaces places;
    Blocks blocks;
    FacingPoints points;
    std::uint64_t drawn = 0;
    for (const SeenBrick &it : seen) {
        if (it.top >= strip.bottom || it.bottom <= strip.top)
            continue;
        const BrickRecord brick = run.chunk->bricks[it.brick];
        const std::size_t first_point = brick.first_point;
        if (first_point >= normals.size())
            continue;
        const std::size_t available = normals.size() - first_point;
        const std::size_t count = std::min(list_places(brick, run.chunk->masks, places), available);
        const std::size_t begin = run.first > first_point ? run.first - first_point : 0;
        const std::size_t end = run.last > first_point ? std::min<std::size_t>(count, run.last - first_point) : 0;
        const auto base_id = first_id + static_cast<std::uint32_t>(first_point);
        if (!it.large) {
            const std::size_t before = points.count;
            find_facing_points(frame, geometry, it, places, begin, end, normals.data() + first_point, available,
                               base_id, strip, points);
            drawn += points.count - before;
            if (points.count >= kWaiting)
                draw_points(frame, geometry.voxel, blocks, points, strip);
            continue;
        }
        for (std::size_t i = begin; i < end; ++i) {
            const VoxelPlace place = places.place[i];
            const glm::vec3 image = glm::vec3(it.u, it.v, it.w) + static_cast<float>(place & 15) * geometry.steps[0] +
                                    static_cast<float>(place >> 4 & 15) * geometry.steps[1] +
                                    static_cast<float>(place >> 8) * geometry.steps[2];
            const std::uint16_t normal = normals[first_point + i];
            const SplatSize size{frame.radii[run.chunk->radii[first_point + i]], geometry.voxel,
                                 (normal & kTwoSidedBit) != 0};
            drawn += draw_ellipse(frame, size, normal, image, base_id + static_cast<std::uint32_t>(i), strip);
        }
    }
    draw_points(frame, geometry.voxel, blocks, points, strip);
    return drawn;
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(draw_bricks);

bool draw_ellipse(const FrameGeometry &frame, const SplatSize &size, std::uint16_t stored, const glm::vec3 &image,
                  std::uint32_t id, DepthStrip &strip) {
    // Points nearer to the eye than this, in splat radii, have the eye inside or next to them.
    constexpr float kLeastDistance = 1.25F;
    if (image.z <= kLeastDistance * size.radius)
        return false;
    const float inverse = 1 / image.z;
    const glm::vec2 pixel(image.x * inverse, image.y * inverse);
    ScreenNormal normal = frame.screen_normal(stored & kNormalIndexMask);
    float facing = glm::dot(normal.plane, glm::vec3(pixel, 1));
    if (size.two_sided && facing > 0) {
        normal = frame.screen_normal((stored & kNormalIndexMask) ^ kOppositeNormal);
        facing = -facing;
    }
    if (facing > kFacingSlack)
        return false;
    const SplatShape shape = lay_splat(frame.projection, normal, pixel, facing, size);
    const auto clip = [](float edge, int least, int most) {
        return static_cast<int>(std::clamp(std::floor(edge + 0.5F), static_cast<float>(least), static_cast<float>(most)));
    };
    const int left = clip(pixel.x + inverse * shape.box[0], 0, strip.width);
    const int right = clip(pixel.x + inverse * shape.box[1], 0, strip.width);
    const int top = clip(pixel.y + inverse * shape.box[2], strip.top, strip.bottom);
    const int bottom = clip(pixel.y + inverse * shape.box[3], strip.top, strip.bottom);
    const glm::vec2 middle = pixel + inverse * glm::vec2(shape.shift[0], shape.shift[2]);
    const float slope_x = image.z * shape.slope_x[0], slope_y = image.z * shape.slope_y[0];
    const float at_middle = image.z + shape.depth_shift[0], inside = inverse * inverse;
    for (int row = top; row < bottom; ++row) {
        const float y = static_cast<float>(row) + 0.5F - middle.y;
        double *const pixels = strip.pixels.data() + strip.offset(0, row);
        for (int column = left; column < right; ++column) {
            const float x = static_cast<float>(column) + 0.5F - middle.x;
            if (x * (shape.xx[0] * x + shape.xy[0] * y) + shape.yy[0] * y * y > inside)
                continue;
            const float z = at_middle + (slope_x * x + slope_y * y);
            const auto bits = std::bit_cast<std::uint32_t>(z);
            pixels[column] = std::min(pixels[column], std::bit_cast<double>(std::uint64_t{bits} << 32 | id));
        }
    }
    return left < right && top < bottom;
}

std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip) {
    return HWY_DYNAMIC_DISPATCH(draw_bricks)(frame, run, seen, first_id, strip);
}

} // namespace pbm
#endif // HWY_ONCE
