// Three-dimensional vectors in SIMD lanes, and powers. For files that Highway compiles for several targets: include it
// after highway.h, once per target.
#if defined(PBM_RENDER_LANE_VECTORS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_LANE_VECTORS_H
#undef PBM_RENDER_LANE_VECTORS_H
#else
#define PBM_RENDER_LANE_VECTORS_H
#endif

#include "pbm_render/picture/packing.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// One three-dimensional vector per lane.
struct Vector3 {
    Vector x, y, z;
};

HWY_INLINE Vector3 broadcast(float x, float y, float z) {
    const Floats d;
    return {hn::Set(d, x), hn::Set(d, y), hn::Set(d, z)};
}
HWY_INLINE Vector dot(const Vector3 &a, const Vector3 &b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vector3 scaled(const Vector3 &v, Vector by) {
    return {hn::Mul(v.x, by), hn::Mul(v.y, by), hn::Mul(v.z, by)};
}
HWY_INLINE Vector3 negated(const Vector3 &v) { return {hn::Neg(v.x), hn::Neg(v.y), hn::Neg(v.z)}; }
HWY_INLINE Vector3 difference(const Vector3 &a, const Vector3 &b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vector3 normalised(const Vector3 &v) {
    const Floats d;
    return scaled(v, hn::Div(hn::Set(d, 1), hn::Sqrt(hn::Max(dot(v, v), hn::Set(d, 1e-30F)))));
}

// base^exponent for 0 <= base <= 1 (plus rounding) and 0 < exponent; 0^0 is 0. Computes 2^(exponent log2 base) by
// polynomials, since libraries differ in the last bits. The relative error of visible results is below 2e-6.
HWY_INLINE Vector power_of(Vector base, Vector exponent) {
    const Floats d;
    const Ints di;
    constexpr std::int32_t kRootHalf = 0x3F3504F3; // bits of sqrt(1/2)
    const IntVector bits = hn::BitCast(di, base);
    const IntVector steps = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, kRootHalf)));
    const Vector mantissa = hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(steps))); // sqrt(1/2) .. sqrt(2)
    // log2 m = 2 / ln 2 artanh((m - 1) / (m + 1))
    const Vector one = hn::Set(d, 1.0F);
    const Vector z = hn::Div(hn::Sub(mantissa, one), hn::Add(mantissa, one));
    const Vector square = hn::Mul(z, z);
    Vector series = hn::Set(d, 2.885390082F / 9);
    for (const float term : {2.885390082F / 7, 2.885390082F / 5, 2.885390082F / 3, 2.885390082F})
        series = hn::Add(hn::Mul(series, square), hn::Set(d, term));
    const Vector log2 = hn::Add(hn::ConvertTo(d, steps), hn::Mul(series, z));
    const Vector raised = hn::Max(hn::Mul(log2, exponent), hn::Set(d, -126.0F));
    const Vector whole = hn::Round(raised);
    const Vector rest = hn::Sub(raised, whole); // -0.5 .. 0.5
    Vector sum = hn::Set(d, 0.00133908634F);
    for (const float term : {0.00967603192F, 0.0555035711F, 0.240221075F, 0.693147188F, 1.00000008F})
        sum = hn::Add(hn::Mul(sum, rest), hn::Set(d, term));
    const Vector result = hn::BitCast(d, hn::Add(hn::BitCast(di, sum), hn::ShiftLeft<23>(hn::ConvertTo(di, whole))));
    return hn::IfThenElseZero(hn::Gt(base, hn::Set(d, 1e-30F)), result);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
