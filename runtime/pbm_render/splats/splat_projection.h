// Computes a SIMD vector of splats as splat.h computes one. For files that Highway compiles for several targets:
// include it after highway.h, once per target. Results are the same on every target.
#if defined(PBM_RENDER_SPLAT_PROJECTION_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_SPLAT_PROJECTION_H
#undef PBM_RENDER_SPLAT_PROJECTION_H
#else
#define PBM_RENDER_SPLAT_PROJECTION_H
#endif

#include "pbm_render/splats/facing_points.h"
#include "system/simd/target_gaps.h"

#include <array>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A vector of splats: what blocks and ellipses have in common.
struct ProjectedSplats {
    SplatNormal normal;
    Vector image_x, image_y; // image of the normal, for focal length and depth 1
    Vector pixel_size;       // at the point's depth
    Vector cosine;           // between the plane's normal and the ray
    Vector outline, inset;   // grid edges
};

// kPlaced: the points have surface offsets; other splats lie at the mean depth of a surface within its voxel.
template <bool kPlaced>
HWY_INLINE ProjectedSplats project_splats(const FrameGeometry &frame, float voxel_edge, float outline_inset,
                                          const FacingPoints &points, std::size_t first) {
    const Floats d;
    const Ints di;
    const Vector zero = hn::Zero(d), one = hn::Set(d, 1);
    const auto clamp_to_one = [&](Vector v) { return hn::Min(hn::Max(v, zero), one); };
    const IntVector packed = hn::Load(di, points.normal.data() + first);
    ProjectedSplats s;
    s.normal = splat_normal(frame, packed, hn::Load(d, points.x.data() + first), hn::Load(d, points.y.data() + first),
                            points.are_backs);
    const SplatNormal &n = s.normal;
    // Backs lie at the surface, too: inwards is the other way.
    if (points.are_backs) {
        voxel_edge = -voxel_edge;
        outline_inset += kBackOutlineInset;
    }
    const Vector voxel = hn::IfThenElseZero(hn::Not(n.two_sided), hn::Set(d, voxel_edge));
    s.outline = hn::Mul(hn::Mul(voxel, hn::Set(d, outline_inset)),
                        clamp_to_one(hn::Add(one, hn::Mul(hn::Set(d, kOutlineSlope), n.facing))));
    if constexpr (kPlaced) {
        s.inset = hn::Neg(hn::Mul(voxel, hn::Load(d, points.offset.data() + first)));
        s.outline = hn::Add(s.outline, s.inset);
    } else {
        const Vector edge_on = clamp_to_one(hn::Add(one, n.facing));
        const Vector grazing = hn::Mul(hn::Mul(edge_on, edge_on), edge_on);
        const Vector mean_inset = hn::Mul(hn::ConvertTo(d, hn::And(packed, hn::Set(di, kPackedInsetMask))),
                                          hn::Set(d, 1 / kPackedInsetScale));
        s.inset = hn::Mul(voxel, hn::Add(mean_inset, hn::Mul(hn::Set(d, kGrazingInset), grazing)));
    }
    s.image_x = hn::Sub(n.x, hn::Mul(n.ray_x, n.z));
    s.image_y = hn::Sub(n.y, hn::Mul(n.ray_y, n.z));
    s.pixel_size = hn::Mul(hn::Load(d, points.w.data() + first), hn::Set(d, frame.inverse_focal));
    s.cosine = hn::Max(hn::Neg(n.facing), hn::Set(d, kEdgeOn));
    return s;
}

// Depth per length across the view direction, for one component of a plane's normal.
HWY_INLINE Vector plane_slope(Vector component, Vector inverse_cosine, float steepest = kSteepest) {
    const Vector most = hn::Set(Floats(), steepest), least = hn::Set(Floats(), -steepest);
    return hn::Min(hn::Max(hn::Mul(component, inverse_cosine), least), most);
}

// Depth of the plane in the middle of the splat; the slopes are per unit of depth 1.
HWY_INLINE Vector depth_in_middle(const ProjectedSplats &s, Vector w, Vector slope_x, Vector slope_y) {
    const Vector along = hn::Add(hn::Mul(slope_x, s.image_x), hn::Mul(slope_y, s.image_y));
    return hn::Add(w, hn::Sub(hn::Mul(along, hn::Sub(s.inset, s.outline)), hn::Mul(s.inset, s.normal.z)));
}

// As SplatShape, but at the points' depths: a vector of splats of any size.
struct Ellipses {
    alignas(64) std::array<float, kMaxLanes> x, y, depth;                     // middle
    alignas(64) std::array<float, kMaxLanes> xx, xy, yy;                      // 1 on the outline
    alignas(64) std::array<float, kMaxLanes> slope_x, slope_y;                // of the depth, per pixel
    float cone = 0;                                                           // depth of the outline behind the plane
    alignas(64) std::array<std::int32_t, kMaxLanes> left, right, top, bottom; // pixels, in the strip
};

// Computes the ellipses of a vector of points from `first` on, as project_splat does, into the lanes of `to` from
// `lane` on. Lanes behind the last point get empty ellipses. kWhole: boxes hold all pixels that the ellipses touch, not
// only those whose centres lie in them.
template <bool kPlaced, bool kWhole = false>
HWY_INLINE ProjectedSplats project_ellipses(const StripRun &at, const FacingPoints &points, std::size_t first,
                                            Ellipses &to, std::size_t lane = 0, const Enlargement &enlarged = {}) {
    const FrameGeometry &frame = at.frame;
    const DepthStrip &strip = at.strip;
    const float voxel_edge = at.run.voxel;
    const std::size_t end = points.count;
    const Floats d;
    const Ints di;
    const auto set = [&](float value) { return hn::Set(d, value); };
    const Vector one = set(1), half = set(0.5F);
    const ProjectedSplats s = project_splats<kPlaced>(
        frame, voxel_edge, (kPlaced ? kPlacedOutlineInset : kOutlineInset) + enlarged.inset, points, first);
    const SplatNormal &n = s.normal;
    const Vector radius = hn::Mul(set(enlarged.radius), hn::Load(d, points.radius.data() + first));
    // Lanes behind the last point are uninitialized: the mask keeps the index within the table.
    const IntVector normal = hn::And(hn::Load(di, points.normal_index.data() + first), hn::Set(di, kNormalIndexMask));
    const Vector thickness = hn::Mul(set(kPlaced ? kPlacedThickness * voxel_edge : voxel_edge),
                                     hn::GatherIndex(d, frame.thickness.data(), normal));

    // r^2 I - (r^2 - t^2) n n^T, projected by the Jacobian for focal length and depth 1.
    Vector r2 = hn::Mul(radius, radius);
    if constexpr (kPlaced) {
        const Vector moved = hn::Mul(hn::Load(d, points.offset.data() + first), set(kPlacedShrink * voxel_edge));
        r2 = hn::Max(hn::Sub(r2, hn::Mul(moved, moved)), hn::Mul(r2, set(kPlacedMin * kPlacedMin)));
    }
    const Vector flat = hn::Max(hn::Sub(r2, hn::Mul(thickness, thickness)), hn::Zero(d));
    const Vector least = hn::Mul(set(kMinVariance), hn::Sub(r2, flat));
    const auto covariance = [&](Vector rays, Vector images) {
        return hn::Sub(hn::Mul(r2, rays), hn::Mul(flat, images));
    };
    const Vector low_pass = hn::Mul(set(enlarged.low_pass), s.pixel_size), low_pass2 = hn::Mul(low_pass, low_pass);
    const auto variance_of = [&](Vector ray, Vector image) {
        return hn::Add(hn::Max(covariance(hn::Add(one, hn::Mul(ray, ray)), hn::Mul(image, image)), least), low_pass2);
    };
    const Vector xx = variance_of(n.ray_x, s.image_x), yy = variance_of(n.ray_y, s.image_y);
    const Vector product = hn::Mul(xx, yy), most_xy = hn::Sqrt(hn::Mul(set(kMaxCorrelation), product));
    const Vector xy = hn::Min(
        hn::Max(covariance(hn::Mul(n.ray_x, n.ray_y), hn::Mul(s.image_x, s.image_y)), hn::Neg(most_xy)), most_xy);
    const Vector size2 = hn::Mul(s.pixel_size, s.pixel_size);
    const Vector inverse = hn::Div(size2, hn::Sub(product, hn::Mul(xy, xy)));
    hn::Store(hn::Mul(yy, inverse), d, to.xx.data() + lane);
    hn::Store(hn::Mul(hn::Mul(set(-2), xy), inverse), d, to.xy.data() + lane);
    hn::Store(hn::Mul(xx, inverse), d, to.yy.data() + lane);

    const Vector inverse_cosine = hn::Div(one, s.cosine);
    const float steepest = kPlaced ? kPlacedSteepest : kSteepest;
    const Vector plane_x = plane_slope(n.x, inverse_cosine, steepest),
                 plane_y = plane_slope(n.y, inverse_cosine, steepest);
    hn::Store(hn::Mul(plane_x, s.pixel_size), d, to.slope_x.data() + lane);
    hn::Store(hn::Mul(plane_y, s.pixel_size), d, to.slope_y.data() + lane);
    hn::Store(depth_in_middle(s, hn::Load(d, points.w.data() + first), plane_x, plane_y), d, to.depth.data() + lane);

    const Vector pixels = hn::Div(one, s.pixel_size);
    const auto place = [&](const float *point, Vector image, Vector variance, float from, float to_end, float *middle,
                           std::int32_t *begin, std::int32_t *finish) {
        const Vector centre = hn::Sub(hn::Load(d, point), hn::Mul(hn::Mul(s.outline, image), pixels));
        Vector reach = hn::Mul(hn::Sqrt(variance), pixels);
        if constexpr (kWhole)
            reach = hn::Add(reach, half);
        hn::Store(centre, d, middle);
        // Pixel i is inside if its centre i + 0.5 is: the first one is floor(edge + 0.5).
        const auto edge = [&](Vector v) {
            const Vector inside = hn::Floor(hn::Min(hn::Max(hn::Add(v, half), set(from)), set(to_end)));
            return hn::ConvertTo(di, hn::IfThenElseZero(hn::FirstN(d, end > first ? end - first : 0), inside));
        };
        hn::Store(edge(hn::Sub(centre, reach)), di, begin);
        hn::Store(edge(hn::Add(centre, reach)), di, finish);
    };
    place(points.x.data() + first, s.image_x, xx, 0, static_cast<float>(strip.width), to.x.data() + lane,
          to.left.data() + lane, to.right.data() + lane);
    place(points.y.data() + first, s.image_y, yy, static_cast<float>(strip.top), static_cast<float>(strip.bottom),
          to.y.data() + lane, to.top.data() + lane, to.bottom.data() + lane);
    return s;
}

// Draws one splat: the pixels whose centres lie in the ellipse and that are nearer than the present depth.
template <bool kCone = false>
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
            const float form = x * (xx * x + row_xy) + row_yy, depth = row_depth + slope_x * x;
            if (form <= 1)
                pixels[i] = std::min(pixels[i], DepthStrip::pixel(kCone ? depth + ellipses.cone * form : depth, id));
        }
#else
        const hn::FixedTag<float, 4> d32;
        const hn::FixedTag<std::uint32_t, 4> du32;
        const hn::FixedTag<double, 2> d64;
        const auto four = hn::Set(d32, 4);
        const auto ids = hn::Set(du32, id);
        // Four pixels at once; pixels beside the box also lie outside the ellipse.
        auto x = hn::Add(hn::Set(d32, first_x), hn::Iota(d32, 0));
        for (std::int32_t i = left; i < right; i += 4, x = hn::Add(x, four)) {
            const auto form =
                hn::Add(hn::Mul(x, hn::Add(hn::Mul(hn::Set(d32, xx), x), hn::Set(d32, row_xy))), hn::Set(d32, row_yy));
            const auto inside = hn::Le(form, hn::Set(d32, 1));
            auto depth = hn::Add(hn::Set(d32, row_depth), hn::Mul(hn::Set(d32, slope_x), x));
            if constexpr (kCone)
                depth = hn::Add(depth, hn::Mul(hn::Set(d32, ellipses.cone), form));
            const auto z =
                hn::BitCast(du32, hn::IfThenElse(inside, depth, hn::Set(d32, std::numeric_limits<float>::infinity())));
            const auto draw = [&](auto value, double *to) {
                hn::StoreU(lesser_doubles(hn::BitCast(d64, value), hn::LoadU(d64, to)), d64, to);
            };
            draw(hn::InterleaveLower(du32, ids, z), pixels + i);
            draw(hn::InterleaveUpper(du32, ids, z), pixels + i + 2);
        }
#endif
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
