#include "pbm_render/bricks/frame_geometry.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/bricks/frame_geometry.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/lane_vectors.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// The nearest whole number of -256 .. 255, from bit `kShift` on.
template <int kShift> HWY_INLINE IntVector pack(Vector value) {
    const IntVector number =
        hn::Sub(hn::ConvertTo(Ints(), hn::Add(value, hn::Set(Floats(), 256.5F))), hn::Set(Ints(), 256));
    return hn::ShiftLeft<kShift>(number);
}

void turn_normals(const EyeAxes &axes, std::span<const SplatNormal> table, std::span<EyeNormal> normals,
                  std::span<std::int32_t> packed) {
    static_assert(sizeof(SplatNormal) == 4 * sizeof(float) && sizeof(EyeNormal) == 4 * sizeof(float));
    const Floats d;
    const Ints di;
    const auto axis = [](glm::dvec3 of) {
        const auto floats = glm::vec3(of);
        return broadcast(floats.x, floats.y, floats.z);
    };
    const Vector3 right = axis(axes.right), down = axis(-axes.up), forward = axis(axes.forward);
    const Vector scale = hn::Set(d, kPackedNormalScale), inset_scale = hn::Set(d, kPackedInsetScale / 2);
    for (std::size_t i = 0; i < kNormalCount; i += hn::Lanes(d)) {
        Vector3 n;
        Vector inset;
        hn::LoadInterleaved4(d, &table[i].x, n.x, n.y, n.z, inset);
        const Vector3 eye{dot(n, right), dot(n, down), dot(n, forward)};
        hn::StoreInterleaved4(eye.x, eye.y, eye.z, inset, d, &normals[i].x);
        const IntVector x = pack<23>(hn::Mul(eye.x, scale)),
                        y = hn::And(pack<14>(hn::Mul(eye.y, scale)), hn::Set(di, 0x7FC000)),
                        z = hn::And(pack<5>(hn::Mul(eye.z, scale)), hn::Set(di, 0x3FE0)),
                        inwards = pack<1>(hn::Mul(inset, inset_scale));
        hn::StoreU(hn::Or(hn::Or(x, y), hn::Or(z, inwards)), di, packed.data() + i);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(turn_normals);

FrameGeometry::FrameGeometry(const Projection &p, int picture_width, int picture_height)
    : projection(p), width(picture_width), height(picture_height), focal(static_cast<float>(p.focal)),
      inverse_focal(1 / focal), middle_x(static_cast<float>(p.middle.x)), middle_y(static_cast<float>(p.middle.y)),
      normals(kNormalCount), packed(kNormalCount), normal_mask(drawn_normal_mask(p.has_round_points)),
      radii(radius_table()), thickness(splat_thickness()), shows_backs(p.shows_backs) {
    HWY_DYNAMIC_DISPATCH(turn_normals)(p.axes, splat_normals(), normals, packed);
    if (p.has_round_points) {
        append_facing(normals, {0, 0, -1, 0});
        append_facing(packed, kPackedFacing);
    }
}

} // namespace pbm
#endif // HWY_ONCE
