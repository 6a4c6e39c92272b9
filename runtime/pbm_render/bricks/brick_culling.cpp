#include "pbm_render/bricks/brick_culling.h"

#include "pbm_surface/surface_offsets.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/bricks/brick_culling.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/lane_vectors.h"

#ifndef PBM_RENDER_BRICK_CULLING_LIMITS
#define PBM_RENDER_BRICK_CULLING_LIMITS
namespace pbm {

inline constexpr float kBrickVoxels = 8;
// The bounds below do not hold for eyes nearer than this many times the brick's reach: such bricks are not culled.
inline constexpr float kNearEye = 8;
// Blocks of points up to this fraction of their edge apart leave no gap, at any angle.
inline constexpr float kBlockRoom = 0.8F;
// Blocks of splats that are smaller by this factor leave no gap without redundant points.
inline constexpr float kThinRoom = 1.12F;
// Grid edges. Floats hold the places of bricks relative to eyes up to this far from the cube, else to its middle.
inline constexpr float kFarEye = 100;
// Pixels. Voxels up to this width are drawn as blocks of 2 x 2 pixels, larger ones as blocks of 3 x 3 pixels; either
// are drawn as ellipses where splats are too large for such blocks.
inline constexpr float kSmallVoxel = 1.42F;

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// What is known of a vector of bricks; each brick gets one lane.
struct VisibleLanes {
    std::array<float, kLaneNumbers.size()> u, v, w;
    std::array<std::int32_t, kLaneNumbers.size()> top, bottom;
    // Block, and these bits.
    static constexpr std::int32_t kFacesEye = 256, kThin = 512, kHasFronts = 1024, kHasBacks = 2048, kFacesAway = 4096;
    std::array<std::int32_t, kLaneNumbers.size()> kind;
};

// The records of a vector of bricks, without their node maps.
struct RecordLanes {
    IntVector x, y, z, first_point, end_point, cone_axis, cone_cosine, radius;
};

// Reads bricks `first` .. of a run; `count`: how many there are. Lanes behind the last one repeat it.
HWY_INLINE RecordLanes read_records(const PointRun &run, std::size_t first, std::size_t count) {
    constexpr std::size_t kWords = 4; // of a record that are read
    const Ints di;
    const std::size_t lanes = hn::Lanes(di);
    const std::span<const BrickRecord> bricks = run.chunk->bricks;
    std::array<std::int32_t, kWords * kLaneNumbers.size()> words;
    for (std::size_t lane = 0; lane < lanes; ++lane)
        std::memcpy(&words[kWords * lane], &bricks[first + std::min(lane, count - 1)], kWords * sizeof(std::int32_t));
    IntVector xy, z_point, node_axis, cosine_radius;
    hn::LoadInterleaved4(di, words.data(), xy, z_point, node_axis, cosine_radius);
    const auto low = [&](IntVector word) { return hn::And(word, hn::Set(di, 0xFFFF)); };
    const auto high = [&](IntVector word) { return low(hn::ShiftRight<16>(word)); };
    RecordLanes records{.x = low(xy),
                        .y = high(xy),
                        .z = low(z_point),
                        .first_point = high(z_point),
                        .end_point = hn::Zero(di),
                        .cone_axis = high(node_axis),
                        .cone_cosine = hn::ShiftRight<16>(hn::ShiftLeft<16>(cosine_radius)),
                        .radius = hn::And(hn::ShiftRight<16>(cosine_radius), hn::Set(di, 255))};
    std::array<std::int32_t, kLaneNumbers.size() + 1> points;
    hn::StoreU(records.first_point, di, points.data());
    points[count] =
        first + count < bricks.size() ? bricks[first + count].first_point : static_cast<std::int32_t>(run.last);
    records.end_point = hn::LoadU(di, points.data() + 1);
    return records;
}

// Whether no normal of the cones faces the eye anywhere in the bricks. `sight`: from the eye to the bricks' centres;
// `along`: its product with the cones' axes; `reach`: the bricks' radii; all in eye space.
//
// A point lies at sight + d, with |d| <= reach. For each normal n of the cone, n . sight >= |sight| (turned cosine -
// sines) and n . d >= -reach. So all points face away where the sum of both is above the slack.
HWY_INLINE Mask faces_away(IntVector cone_cosine, const Vector3 &sight, Vector along, Vector reach,
                           float slack = kFacingSlack) {
    const Floats d;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1);
    const Vector inverse_length = hn::Div(one, hn::Sqrt(dot(sight, sight)));
    const Vector cosine = hn::Div(hn::ConvertTo(d, cone_cosine), hn::Set(d, 32767.0F));
    const Vector turned = hn::Mul(along, inverse_length);
    const Vector sines =
        hn::Sqrt(hn::Max(zero, hn::Mul(hn::Sub(one, hn::Mul(cosine, cosine)), hn::Sub(one, hn::Mul(turned, turned)))));
    // The reference's slack refers to rays of depth 1, which are at least as long as the unit ray here.
    const Mask away =
        hn::Gt(hn::Sub(hn::Mul(turned, cosine), sines), hn::Add(hn::Set(d, slack), hn::Mul(reach, inverse_length)));
    return hn::And(hn::Gt(along, zero), away);
}

// Finds which of a vector of bricks may be seen; returns a bit for each.
HWY_INLINE unsigned cull_bricks(const RunGeometry &geometry, const FrameGeometry &frame, const RecordLanes &bricks,
                                VisibleLanes &to) {
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const auto floats = [&](IntVector number) { return hn::ConvertTo(d, number); };
    const auto when = [&](Mask mask, std::int32_t bits) {
        return hn::IfThenElseZero(hn::RebindMask(di, mask), hn::Set(di, bits));
    };
    const PointRun &run = *geometry.run;
    const float voxel = geometry.voxel, half = kBrickVoxels / 2 * voxel;
    const float half_diagonal = half * std::sqrt(3.0F);
    const float to_first = -(kBrickVoxels - 1) / 2;
    const glm::vec3 first = to_first * (geometry.steps[0] + geometry.steps[1] + geometry.steps[2]);
    const EyeAxes &eye_axes = frame.projection.axes;
    const glm::dvec3 to_cube = glm::dvec3(0.5) - frame.projection.eye;
    const bool is_far = glm::length(to_cube) > static_cast<double>(kFarEye);
    const auto origin = is_far ? glm::vec3(0.5F) : glm::vec3(frame.projection.eye);
    const auto to_origin = is_far ? glm::vec3(glm::dot(to_cube, eye_axes.right), -glm::dot(to_cube, eye_axes.up),
                                              glm::dot(to_cube, eye_axes.forward))
                                  : glm::vec3(0);
    const auto axis = [](glm::dvec3 of) {
        const auto narrow = glm::vec3(of);
        return broadcast(narrow.x, narrow.y, narrow.z);
    };
    const auto place = [&](IntVector brick, float from) {
        return hn::Sub(hn::Add(hn::Mul(floats(brick), set(2 * half)), set(half)), set(from));
    };
    const Vector zero = hn::Zero(d), one = set(1);
    const Vector3 sight{place(bricks.x, origin.x), place(bricks.y, origin.y), place(bricks.z, origin.z)};
    const auto along_axis = [&](glm::dvec3 of, float from) { return hn::Add(dot(sight, axis(of)), set(from)); };
    const Vector3 centre{along_axis(eye_axes.right, to_origin.x), along_axis(-eye_axes.up, to_origin.y),
                         along_axis(eye_axes.forward, to_origin.z)};
    const Vector radius = hn::GatherIndex(d, frame.radii.data(), bricks.radius);
    const Vector reach = hn::Add(hn::Add(set(half_diagonal), radius), set(geometry.max_offset));
    const Vector nearest = hn::Sub(centre.z, reach);
    const Mask far = hn::Gt(nearest, hn::Mul(set(kNearEye), reach));
    const auto between = [&](IntVector from, IntVector end) { return hn::RebindMask(d, hn::Lt(from, end)); };
    Mask seen = hn::And(hn::Gt(hn::Add(centre.z, reach), zero),
                        hn::And(between(bricks.first_point, hn::Set(di, static_cast<std::int32_t>(run.last))),
                                between(hn::Set(di, static_cast<std::int32_t>(run.first)), bricks.end_point)));

    const Vector inverse = hn::Div(set(frame.focal), centre.z);
    const Vector extent = hn::Div(hn::Mul(reach, set(frame.focal)), nearest);
    const Vector x = hn::Mul(centre.x, inverse), y = hn::Mul(centre.y, inverse);
    const auto widened = [&](Vector of) {
        return hn::Add(hn::Mul(extent, hn::Add(one, hn::Mul(hn::Abs(of), set(frame.inverse_focal)))), set(2));
    };
    const Vector reach_x = widened(x), reach_y = widened(y);
    const Mask outside = hn::Or(hn::Gt(hn::Abs(x), hn::Add(reach_x, set(frame.middle_x))),
                                hn::Gt(hn::Abs(y), hn::Add(reach_y, set(frame.middle_y))));
    const IntVector axes = hn::ShiftLeft<2>(hn::And(bricks.cone_axis, hn::Set(di, kNormalIndexMask)));
    const float *const normals = &frame.normals.front().x;
    const Vector3 cone{hn::GatherIndex(d, normals, axes), hn::GatherIndex(d, normals + 1, axes),
                       hn::GatherIndex(d, normals + 2, axes)};
    const Vector along = dot(cone, centre);
    const Mask has_cone = hn::RebindMask(d, hn::Ne(bricks.cone_cosine, hn::Set(di, kNoCone)));
    const Mask bounded = hn::And(far, has_cone);
    const Mask only_backs = hn::And(bounded, faces_away(bricks.cone_cosine, centre, along, reach));
    seen = hn::AndNot(hn::And(far, outside), seen);
    IntVector sides = when(hn::Not(only_backs), VisibleLanes::kHasFronts);
    if (frame.shows_backs) {
        const Mask only_fronts = hn::And(bounded, faces_away(bricks.cone_cosine, centre, hn::Neg(along), reach, 0));
        const Mask all_away = hn::And(bounded, faces_away(bricks.cone_cosine, centre, along, reach, 0));
        sides = hn::Or(sides, when(hn::Not(only_fronts), VisibleLanes::kHasBacks));
        sides = hn::Or(sides, when(all_away, VisibleLanes::kFacesAway));
    } else {
        seen = hn::AndNot(only_backs, seen);
    }

    // Off the picture's middle, a length across the ray covers more pixels; blocks leave some room for that.
    const Vector inverse_focal = set(frame.inverse_focal);
    const Vector stretch =
        hn::Sqrt(hn::Add(one, hn::Mul(hn::Mul(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), inverse_focal), inverse_focal)));
    const Vector pixels = hn::Mul(radius, set(frame.focal));
    const Mask is_small = hn::Le(set(voxel * frame.focal), hn::Mul(set(kSmallVoxel), centre.z));
    const IntVector edge = hn::IfThenElse(hn::RebindMask(di, is_small), hn::Set(di, 2), hn::Set(di, 3));
    const Vector largest = hn::Mul(hn::Mul(set(kBlockRadius), floats(edge)), nearest);
    const Mask is_block = hn::Le(hn::Mul(pixels, hn::Max(one, hn::Mul(set(kBlockRoom), stretch))), largest);
    const Mask thin = hn::Le(hn::Mul(hn::Mul(pixels, set(kThinRoom)), stretch), largest);
    const Mask faces_eye = hn::And(has_cone, hn::Le(along, zero));
    const IntVector kind = hn::Or(hn::Or(when(thin, VisibleLanes::kThin), when(faces_eye, VisibleLanes::kFacesEye)),
                                  hn::IfThenElseZero(hn::RebindMask(di, is_block), edge));
    const Vector row = hn::Add(y, set(frame.middle_y)), height = set(static_cast<float>(frame.height));
    const Vector top = hn::IfThenElseZero(far, hn::Max(hn::Sub(row, reach_y), zero));
    const Vector bottom = hn::IfThenElse(far, hn::Min(hn::Add(hn::Add(row, reach_y), one), height), height);
    const IntVector top_row = hn::ConvertTo(di, top), bottom_row = hn::ConvertTo(di, bottom);
    hn::StoreU(top_row, di, to.top.data());
    hn::StoreU(bottom_row, di, to.bottom.data());
    const IntVector any_kind = hn::IfThenElse(hn::RebindMask(di, far), kind, hn::Set(di, VisibleLanes::kFacesEye));
    hn::StoreU(hn::Or(any_kind, sides), di, to.kind.data());
    const auto project = [&](Vector across, float middle, float from) {
        return hn::Add(hn::Add(hn::Mul(set(frame.focal), across), hn::Mul(set(middle), centre.z)), set(from));
    };
    hn::StoreU(project(centre.x, frame.middle_x, first.x), d, to.u.data());
    hn::StoreU(project(centre.y, frame.middle_y, first.y), d, to.v.data());
    hn::StoreU(hn::Add(centre.z, set(first.z)), d, to.w.data());
    seen = hn::And(seen, hn::RebindMask(d, hn::Lt(top_row, bottom_row)));
    return mask_bits(seen);
}

// How the centres of a brick's voxels lie to the camera's clip region.
HWY_INLINE HalfSpaces::Side side_of_clip(const HalfSpaces &clip, const BrickRecord &brick, float voxel) {
    if (clip.empty())
        return HalfSpaces::Side::inside;
    const double half = static_cast<double>(kBrickVoxels / 2 * voxel);
    return clip.side_of(glm::dvec3(brick.x, brick.y, brick.z) * (2 * half) + half, glm::dvec3(half));
}

std::size_t find_visible_bricks(const RunGeometry &geometry, const FrameGeometry &frame, std::span<VisibleBrick> to) {
    const PointRun &run = *geometry.run;
    const HalfSpaces &clip = frame.projection.clip;
    const std::size_t lanes = hn::Lanes(Floats()), bricks = run.chunk->bricks.size();
    VisibleLanes lane_values;
    std::size_t seen = 0;
    for (std::size_t i = 0; i < bricks; i += lanes) {
        const std::size_t count = std::min(lanes, bricks - i);
        unsigned bits = cull_bricks(geometry, frame, read_records(run, i, count), lane_values);
        for (bits &= (1U << count) - 1; bits != 0; bits &= bits - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
            const std::int32_t kind = lane_values.kind[lane];
            const HalfSpaces::Side side = side_of_clip(clip, run.chunk->bricks[i + lane], geometry.voxel);
            if (side == HalfSpaces::Side::outside)
                continue;
            const bool is_cut = side == HalfSpaces::Side::cut || run.hides_points;
            to[seen++] = {.u = lane_values.u[lane],
                          .v = lane_values.v[lane],
                          .w = lane_values.w[lane],
                          .brick = static_cast<std::uint32_t>(i + lane),
                          .top = lane_values.top[lane],
                          .bottom = lane_values.bottom[lane],
                          .left = 0,
                          .right = frame.width,
                          .nearest = 0,
                          .faces_eye = (kind & VisibleLanes::kFacesEye) != 0,
                          .has_fronts = (kind & VisibleLanes::kHasFronts) != 0,
                          .has_backs = (kind & VisibleLanes::kHasBacks) != 0,
                          .faces_away = (kind & VisibleLanes::kFacesAway) != 0,
                          .block = static_cast<std::uint8_t>(kind & 3),
                          .thin = (kind & VisibleLanes::kThin) != 0 && !is_cut,
                          .is_cut = is_cut};
        }
    }
    return seen;
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(find_visible_bricks);

RunGeometry::RunGeometry(const PointRun &points, const FrameGeometry &frame)
    : run(&points), voxel(std::ldexp(1.0F, -points.level)),
      max_offset(points.offsets == nullptr ? 0 : kMaxOffset * voxel) {
    const double edge = std::ldexp(1.0, -points.level);
    steps = {glm::vec3(frame.projection.vector({edge, 0, 0})), glm::vec3(frame.projection.vector({0, edge, 0})),
             glm::vec3(frame.projection.vector({0, 0, edge}))};
}

std::size_t find_visible_bricks(const RunGeometry &geometry, const FrameGeometry &frame, std::span<VisibleBrick> to) {
    return HWY_DYNAMIC_DISPATCH(find_visible_bricks)(geometry, frame, to);
}

} // namespace pbm
#endif // HWY_ONCE
