// Collects the points of bricks that face the eye, and those that face away, in screen space. For files that Highway
// compiles for several targets: include it after highway.h, once per target. Results are the same on every target.
#if defined(PBM_RENDER_FACING_POINTS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_FACING_POINTS_H
#undef PBM_RENDER_FACING_POINTS_H
#else
#define PBM_RENDER_FACING_POINTS_H
#endif

#include "pbm_render/picture/packing.h"
#include "pbm_surface/brick_neighbours.h"
#include "pbm_surface/brick_places.h"

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/chunk_offsets.h"
#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/bricks/point_ids.h"
#include "pbm_render/splats/depth_strip.h"
#include "pbm_render/splats/facing_point_arrays.h"
#include "pbm_render/splats/splat.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>

#ifndef PBM_RENDER_FACING_POINTS_TABLES
#define PBM_RENDER_FACING_POINTS_TABLES
namespace pbm {

// A word of FrameGeometry::packed.
struct PointNormal {
    glm::vec3 axis; // eye space
    float inset;    // voxel edges
    bool two_sided;
};
inline PointNormal unpack_normal(std::int32_t packed) {
    const auto word = static_cast<std::uint32_t>(packed);
    const glm::vec3 whole(packed >> 23, static_cast<std::int32_t>(word << 9) >> 23,
                          static_cast<std::int32_t>(word << 18) >> 23);
    return {glm::normalize(whole), static_cast<float>(packed & kPackedInsetMask) / kPackedInsetScale,
            (packed & kPackedTwoSided) != 0};
}

// Shifts kTwoSidedBit of a stored normal to kPackedTwoSided.
inline constexpr int kTwoSidedShift = std::countr_zero(kTwoSidedBit);

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A normal in eye space at a point on the screen; that of a back or of a two-sided point is turned towards the eye.
struct SplatNormal {
    Vector x, y, z;
    Vector ray_x, ray_y; // from the eye through the point, depth 1
    Vector facing;       // cosine between normal and ray, times the ray's length
    Vector turn;         // the sign bit if the normal was turned, else 0
    Mask two_sided;
};

HWY_INLINE SplatNormal splat_normal(const FrameGeometry &frame, IntVector packed, Vector pixel_x, Vector pixel_y,
                                    bool are_backs) {
    const Floats d;
    const Ints di;
    const Vector scale = hn::Set(d, 1 / kPackedNormalScale), inverse_focal = hn::Set(d, frame.inverse_focal);
    SplatNormal n;
    n.x = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<23>(packed)), scale);
    n.y = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<23>(hn::ShiftLeft<9>(packed))), scale);
    n.z = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<23>(hn::ShiftLeft<18>(packed))), scale);
    n.ray_x = hn::Mul(hn::Sub(pixel_x, hn::Set(d, frame.middle_x)), inverse_focal);
    n.ray_y = hn::Mul(hn::Sub(pixel_y, hn::Set(d, frame.middle_y)), inverse_focal);
    const Vector facing = hn::Add(hn::Add(hn::Mul(n.x, n.ray_x), hn::Mul(n.y, n.ray_y)), n.z);
    n.two_sided = hn::RebindMask(d, hn::TestBit(packed, hn::Set(di, kPackedTwoSided)));
    const Vector turn =
        are_backs ? hn::SignBit(d) : hn::IfThenElseZero(n.two_sided, hn::AndNot(facing, hn::SignBit(d)));
    n.x = hn::Xor(n.x, turn);
    n.y = hn::Xor(n.y, turn);
    n.z = hn::Xor(n.z, turn);
    n.facing = hn::Xor(facing, turn);
    n.turn = turn;
    return n;
}

// Distance of a brick's voxels from a border of the clip region, grid edges; inside it is 0 or more.
struct BrickCut {
    float first;                  // of the centre of its first voxel
    float step_x, step_y, step_z; // from a voxel to the next
};

// Writes the brick's distances from all borders of the region; `to` has room for them.
inline HWY_NOINLINE std::span<const BrickCut> list_cuts(const HalfSpaces &region, const BrickRecord &brick, float voxel,
                                                        std::array<BrickCut, HalfSpaces::kMax> &to) {
    const glm::dvec3 first =
        (glm::dvec3(brick.x, brick.y, brick.z) * double{kBrickEdge} + 0.5) * static_cast<double>(voxel);
    std::size_t count = 0;
    for (const auto &[normal, offset] : region.all()) {
        const auto step = glm::vec3(normal) * voxel;
        to[count++] = {static_cast<float>(glm::dot(normal, first) + offset), step.x, step.y, step.z};
    }
    return std::span(to).first(count);
}

// The points of a brick in the chunk's streams: points begin .. end - 1 are drawn, `available` points may be read.
struct BrickPoints {
    const std::uint16_t *normals;
    const std::uint8_t *radii;
    const std::int8_t *offsets; // padded to whole SIMD vectors; null: no surface offsets
    std::size_t available;
    std::size_t begin, end;
    std::uint32_t first_id; // of the brick's first point
    std::span<const BrickCut> cuts;
};

// How an ellipse differs from the image of its splat (splat.h).
struct Enlargement {
    float radius = 1;   // times the splat radius
    float low_pass = 0; // pixels: replaces a radius r by sqrt(r^2 + low_pass^2)
    float inset = 0;    // voxel edges: added to the inset of outlines
};

// Upper bound of the rows between a point and the border of its ellipse. `radius`: of the splat, grid edges; `ray_y`: y
// of the ray through the point, depth 1; `inverse_depth`: 1 / depth of the point.
HWY_INLINE Vector rows_to_border(const StripRun &at, const Enlargement &enlarged, Vector radius, Vector ray_y,
                                 Vector inverse_depth) {
    constexpr float kRounding = 1.02F; // packed normals are up to 1 % too long
    const Floats d;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector moved = set(kOutlineInset * at.run.voxel + at.run.max_offset);
    const Vector reach = hn::Add(hn::Mul(radius, set(enlarged.radius)), moved);
    const Vector stretch = hn::Mul(hn::Add(set(1), hn::Abs(ray_y)), set(kRounding * at.frame.focal));
    return hn::Add(hn::Mul(hn::Mul(reach, stretch), inverse_depth), set(enlarged.low_pass + 1));
}

// A vector of points of which some are around the eye. (u, v, w): as of VisibleBrick.
struct NearPoints {
    Mask is_near;
    Vector u, v, w;
    IntVector packed, offset;
    Vector radius;
    IntVector stored; // normals
};

// Destinations of a brick's points: of those that face the eye, and of those that face away; null: leaves them out.
struct BothSides {
    FacingPoints *fronts, *backs;
};

// Appends points around the eye. Returns their number in the first strip, else 0, so that each counts once. `first_id`:
// id of the vector's first point.
template <bool kPlaced>
HWY_NOINLINE std::size_t add_near(const StripRun &at, const NearPoints &points, std::size_t first_id,
                                  const BothSides &to) {
    const bool counts = at.strip.top == 0; // a point around the eye may touch every strip
    std::size_t added = 0;
    const FrameGeometry &frame = at.frame;
    const Floats d;
    const Ints di;
    std::array<float, kLaneNumbers.size()> u, v, w, radii;
    std::array<std::int32_t, kLaneNumbers.size()> packed, offsets, stored;
    hn::StoreU(points.u, d, u.data());
    hn::StoreU(points.v, d, v.data());
    hn::StoreU(points.w, d, w.data());
    hn::StoreU(points.radius, d, radii.data());
    hn::StoreU(points.packed, di, packed.data());
    hn::StoreU(points.offset, di, offsets.data());
    hn::StoreU(points.stored, di, stored.data());
    for (unsigned bits = mask_bits(points.is_near); bits != 0; bits &= bits - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
        const glm::vec3 point((u[lane] - frame.middle_x * w[lane]) * frame.inverse_focal,
                              (v[lane] - frame.middle_y * w[lane]) * frame.inverse_focal, w[lane]);
        const PointNormal normal = unpack_normal(packed[lane]);
        const bool is_back = !normal.two_sided && glm::dot(normal.axis, point) > kFacingSlack * glm::length(point);
        FacingPoints *const side = is_back ? to.backs : to.fronts;
        if (side == nullptr ||
            ((stored[lane] & kSideBit) != 0 && glm::dot(normal.axis, point) > kSideSlack * glm::length(point)))
            continue;
        float inset = 0;
        if (!normal.two_sided)
            inset = kPlaced ? -static_cast<float>(offsets[lane]) / kOffsetSteps : normal.inset;
        const glm::vec3 centre = point - inset * at.run.voxel * normal.axis;
        added += counts;
        side->near.push_back({.centre = {centre.x, centre.y, centre.z},
                              .normal = {normal.axis.x, normal.axis.y, normal.axis.z},
                              .radius = radii[lane],
                              .cone = kPlacedCone * at.run.voxel,
                              .id = static_cast<std::uint32_t>(first_id + lane) | (is_back ? PointIds::kBackBit : 0)});
    }
    return added;
}

// Projects the points of a brick to the screen and appends those that may touch the strip to `to`. Returns the number
// of these whose centres lie in the strip.
//
//   kBlock   VisibleBrick::block of the brick
//   kPlaced  the points have surface offsets; redundant points of thin bricks are left out if they would be blocks
//   kBacks   VisibleBrick::has_backs of the brick
template <int kBlock, bool kPlaced, bool kBacks>
HWY_INLINE std::size_t find_facing_points(const StripRun &at, const VisibleBrick &brick, const BrickPlaces &places,
                                          const BrickPoints &points, const BothSides &to,
                                          const Enlargement &enlarged = {}) {
    const auto &[frame, run, strip] = at;
    const Floats d;
    const Ints di;
    const hn::Rebind<std::uint16_t, Floats> d16;
    const hn::Rebind<std::uint8_t, Floats> d8;
    const hn::Rebind<std::int8_t, Floats> signed8;
    const std::size_t lanes = hn::Lanes(d);
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto &[step_x, step_y, step_z] = run.steps;
    constexpr bool kLarge = kBlock == 0, kHasRadius = kBlock != 2;
    // Largest distance in pixels between a block and its point, with rounding: a voxel is at most 0.71 blocks wide.
    constexpr float kShift = (kPlaced ? 1.5F : 1) * kBlock;
    const Vector above = set(static_cast<float>(strip.top) - kShift),
                 below = set(static_cast<float>(strip.bottom) + kShift);
    const Vector strip_top = set(static_cast<float>(strip.top)), strip_bottom = set(static_cast<float>(strip.bottom));
    constexpr float kNowhere = std::numeric_limits<float>::infinity();
    const Vector home_top = set(strip.top == 0 ? -kNowhere : static_cast<float>(strip.top));
    const Vector home_bottom = set(strip.bottom == frame.height ? kNowhere : static_cast<float>(strip.bottom));
    const float slack = kBacks && brick.faces_away ? 0 : kFacingSlack;
    std::size_t at_home = 0, fronts = !kBacks || to.fronts != nullptr ? to.fronts->count : 0;
    [[maybe_unused]] std::size_t backs = kBacks ? to.backs->count : 0;
    for (std::size_t i = points.begin; i < points.end; i += lanes) {
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
        [[maybe_unused]] auto offset = hn::Zero(di);
        if (i + lanes <= points.available) {
            stored = hn::PromoteTo(di, hn::LoadU(d16, points.normals + i));
            if constexpr (kHasRadius)
                radius_index = hn::PromoteTo(di, hn::LoadU(d8, points.radii + i));
        } else { // the chunk's last points
            alignas(32) std::array<std::uint16_t, kMaxLanes> last{};
            alignas(32) std::array<std::uint8_t, kMaxLanes> last_radii{};
            std::copy_n(points.normals + i, points.available - i, last.begin());
            std::copy_n(points.radii + i, points.available - i, last_radii.begin());
            stored = hn::PromoteTo(di, hn::Load(d16, last.data()));
            radius_index = hn::PromoteTo(di, hn::Load(d8, last_radii.data()));
        }
        if constexpr (kPlaced)
            offset = hn::PromoteTo(di, hn::LoadU(signed8, points.offsets + i));
        const auto sidedness = hn::And(hn::ShiftRight<kTwoSidedShift>(stored), hn::Set(di, kPackedTwoSided));
        const IntVector index = hn::And(stored, hn::Set(di, frame.normal_mask));
        const IntVector packed = hn::Or(hn::GatherIndex(di, frame.packed.data(), index), sidedness);
        const SplatNormal normal = splat_normal(frame, packed, pixel_x, pixel_y, false);
        const Mask faces = hn::Le(normal.facing, set(slack));
        Mask keep = hn::FirstN(d, points.end - i);
        if (run.run->has_sides) [[unlikely]] { // sides that face away were turned, and face the eye now
            const Mask away = hn::And(hn::RebindMask(d, hn::Lt(hn::BitCast(di, normal.turn), hn::Zero(di))),
                                      hn::Lt(normal.facing, set(-kSideSlack)));
            const Mask sides = hn::RebindMask(d, hn::TestBit(stored, hn::Set(di, kSideBit)));
            keep = hn::AndNot(hn::And(away, sides), keep);
        }
        if (brick.is_cut) [[unlikely]] {
            for (const BrickCut &cut : points.cuts)
                keep = hn::And(keep, hn::Ge(project(cut.first, cut.step_x, cut.step_y, cut.step_z), hn::Zero(d)));
            const auto hidden = hn::Set(di, kHiddenBits);
            keep = hn::AndNot(hn::RebindMask(d, hn::Eq(hn::And(stored, hidden), hidden)), keep);
        }
        if constexpr (kPlaced) {
            if constexpr (!kLarge) {
                const auto left_out = hn::Set(di, brick.thin ? kRedundantBit : 0);
                keep = hn::And(keep, hn::RebindMask(d, hn::Eq(hn::And(offset, left_out), hn::Zero(di))));
            }
            offset = hn::AndNot(hn::Set(di, kRedundantBit), offset);
        }
        [[maybe_unused]] Vector radius = hn::Zero(d);
        if constexpr (kHasRadius)
            radius = hn::GatherIndex(d, frame.radii.data(), radius_index);
        if constexpr (kLarge) {
            const Mask is_far = hn::Gt(w, hn::Add(hn::Mul(radius, set(kMinRadii)), set(kMinVoxels * run.voxel)));
            if (const Mask is_near = hn::AndNot(is_far, hn::And(keep, hn::Gt(w, hn::Neg(radius))));
                !hn::AllFalse(d, is_near)) [[unlikely]] {
                const Vector u = project(brick.u, step_x.x, step_y.x, step_z.x),
                             v = project(brick.v, step_x.y, step_y.y, step_z.y);
                at_home +=
                    add_near<kPlaced>(at, {is_near, u, v, w, packed, offset, radius, stored}, points.first_id + i, to);
            }
            keep = hn::And(keep, is_far);
            const Vector reach = rows_to_border(at, enlarged, radius, normal.ray_y, inverse);
            keep = hn::And(keep, hn::And(hn::Gt(hn::Add(pixel_y, reach), strip_top),
                                         hn::Lt(hn::Sub(pixel_y, reach), strip_bottom)));
        } else {
            keep = hn::And(keep, hn::And(hn::Gt(pixel_y, above), hn::Lt(pixel_y, below)));
        }
        const IntVector id = count_from(static_cast<std::int32_t>(points.first_id + i));
        const auto append = [&](Mask some, IntVector ids, FacingPoints &side, std::size_t &count) {
            const Packing pack(some);
            hn::StoreU(pack(pixel_x), d, side.x.data() + count);
            hn::StoreU(pack(pixel_y), d, side.y.data() + count);
            hn::StoreU(pack(w), d, side.w.data() + count);
            hn::StoreU(pack(packed), di, side.normal.data() + count);
            hn::StoreU(pack(ids), di, side.id.data() + count);
            if constexpr (kPlaced)
                hn::StoreU(pack(hn::Mul(hn::ConvertTo(d, offset), set(1 / kOffsetSteps))), d,
                           side.offset.data() + count);
            if constexpr (kHasRadius)
                hn::StoreU(pack(radius), d, side.radius.data() + count);
            if constexpr (kLarge)
                hn::StoreU(pack(index), di, side.normal_index.data() + count);
            count += hn::CountTrue(d, some);
            at_home +=
                hn::CountTrue(d, hn::And(some, hn::And(hn::Ge(pixel_y, home_top), hn::Lt(pixel_y, home_bottom))));
        };
        if (!kBacks || to.fronts != nullptr)
            append(hn::And(keep, faces), id, *to.fronts, fronts);
        if constexpr (kBacks)
            if (const Mask away = hn::AndNot(faces, keep); !hn::AllFalse(d, away))
                append(away, hn::Or(id, hn::Set(di, static_cast<std::int32_t>(PointIds::kBackBit))), *to.backs, backs);
    }
    if (!kBacks || to.fronts != nullptr)
        to.fronts->count = fronts;
    if constexpr (kBacks)
        to.backs->count = backs;
    return at_home;
}

// Appends those points of a brick that find_facing_points keeps, and returns its result. The id of point i of the chunk
// is `first_id` + i. Accesses stay in bounds if the bytes of a mapped chunk change.
template <int kBlock, bool kPlaced, bool kBacks>
HWY_INLINE std::size_t add_brick(const StripRun &at, const VisibleBrick &seen, std::uint32_t first_id,
                                 const BothSides &to, const Enlargement &enlarged = {}) {
    const PointRun &run = *at.run.run;
    const std::span<const std::uint16_t> normals = run.chunk->normals;
    const BrickRecord brick = run.chunk->bricks[seen.brick];
    const std::size_t first_point = brick.first_point;
    if (first_point >= normals.size() || brick.first_node >= run.chunk->masks.size())
        return 0;
    BrickOffsets memory;
    std::array<BrickCut, HalfSpaces::kMax> cuts;
    BrickPoints points{.normals = normals.data() + first_point,
                       .radii = run.chunk->radii.data() + first_point,
                       .offsets = kPlaced ? run.offsets->read(*run.chunk, seen.brick, memory) : nullptr,
                       .available = normals.size() - first_point,
                       .begin = run.first > first_point ? run.first - first_point : 0,
                       .end = 0,
                       .first_id = first_id + static_cast<std::uint32_t>(first_point),
                       .cuts = {}};
    if (seen.is_cut)
        points.cuts = list_cuts(at.frame.projection.clip, brick, at.run.voxel, cuts);
    BrickPlaces places;
    const std::size_t count =
        std::min(list_places(brick.node_map, run.chunk->masks.subspan(brick.first_node), places), points.available);
    points.end = run.last > first_point ? std::min<std::size_t>(count, run.last - first_point) : 0;
    return find_facing_points<kBlock, kPlaced, kBacks>(at, seen, places, points, to, enlarged);
}

// The same for bricks with backs: apart, so that the loop over others stays small.
template <int kBlock, bool kPlaced>
HWY_NOINLINE std::size_t add_brick_with_backs(const StripRun &at, const VisibleBrick &seen, std::uint32_t first_id,
                                              const BothSides &to, const Enlargement &enlarged = {}) {
    return add_brick<kBlock, kPlaced, true>(at, seen, first_id, to, enlarged);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
