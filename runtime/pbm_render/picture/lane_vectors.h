// Three-dimensional vectors in SIMD lanes, powers, and sRGB. For files that Highway compiles for several targets:
// include it after highway.h, once per target.
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

// log2 of numbers above 1e-30, by a polynomial, since libraries differ in the last bits.
HWY_INLINE Vector log2_of(Vector number) {
    const Floats d;
    const Ints di;
    constexpr std::int32_t kRootHalf = 0x3F3504F3; // bits of sqrt(1/2)
    const IntVector bits = hn::BitCast(di, number);
    const IntVector steps = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, kRootHalf)));
    const Vector mantissa = hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(steps))); // sqrt(1/2) .. sqrt(2)
    // log2 m = 2 / ln 2 artanh((m - 1) / (m + 1))
    const Vector one = hn::Set(d, 1.0F);
    const Vector z = hn::Div(hn::Sub(mantissa, one), hn::Add(mantissa, one));
    const Vector square = hn::Mul(z, z);
    Vector series = hn::Set(d, 2.885390082F / 9);
    for (const float term : {2.885390082F / 7, 2.885390082F / 5, 2.885390082F / 3, 2.885390082F})
        series = hn::Add(hn::Mul(series, square), hn::Set(d, term));
    return hn::Add(hn::ConvertTo(d, steps), hn::Mul(series, z));
}

// base^exponent for 0 <= base <= 1 (plus rounding) and 0 < exponent; 0^0 is 0. Computes 2^(exponent log2 base); 2^x is
// a polynomial too. The relative error of visible results is below 2e-6.
HWY_INLINE Vector power_of(Vector base, Vector exponent) {
    const Floats d;
    const Ints di;
    const Vector raised = hn::Max(hn::Mul(log2_of(base), exponent), hn::Set(d, -126.0F));
    const Vector whole = hn::Round(raised);
    const Vector rest = hn::Sub(raised, whole); // -0.5 .. 0.5
    Vector sum = hn::Set(d, 0.00133908634F);
    for (const float term : {0.00967603192F, 0.0555035711F, 0.240221075F, 0.693147188F, 1.00000008F})
        sum = hn::Add(hn::Mul(sum, rest), hn::Set(d, term));
    const Vector result = hn::BitCast(d, hn::Add(hn::BitCast(di, sum), hn::ShiftLeft<23>(hn::ConvertTo(di, whole))));
    return hn::IfThenElseZero(hn::Gt(base, hn::Set(d, 1e-30F)), result);
}

// The same for an exponent that all lanes share: whole ones take few multiplications.
HWY_INLINE Vector power_of(Vector base, float exponent) {
    constexpr int kMaxFactors = 64;
    const Floats d;
    const int whole = exponent <= kMaxFactors ? static_cast<int>(exponent) : 0;
    if (whole == 0 || static_cast<float>(whole) != exponent)
        return power_of(base, hn::Set(d, exponent));
    Vector square = base;
    int bits = whole;
    for (; (bits & 1) == 0; bits >>= 1)
        square = hn::Mul(square, square);
    Vector result = square;
    while ((bits >>= 1) != 0) {
        square = hn::Mul(square, square);
        if ((bits & 1) != 0)
            result = hn::Mul(result, square);
    }
    return result;
}

// Linear light of a byte of sRGB colours, that byte's lowest bit at `shift`. Its sRGB is wrong by less than 0.1.
template <int kShift> HWY_INLINE Vector linear_light(IntVector srgb) {
    const Floats d;
    const Vector value =
        hn::Mul(hn::ConvertTo(d, hn::And(hn::ShiftRight<kShift>(srgb), hn::Set(Ints(), 255))), hn::Set(d, 1.0F / 255));
    Vector sum = hn::Set(d, 0.0532568801F);
    for (const float term : {-0.224016145F, 0.595219524F, 0.545374889F, 0.0291233026F, 0.00105325688F})
        sum = hn::Add(hn::Mul(sum, value), hn::Set(d, term));
    constexpr float kDark = 0.04045F; // below it sRGB is a multiple of linear light
    return hn::IfThenElse(hn::Lt(value, hn::Set(d, kDark)), hn::Mul(value, hn::Set(d, 1 / 12.92F)), sum);
}

// sRGB bytes of linear light, clamped to 0 .. 1. Before it is rounded the result is wrong by less than 0.1: computed by
// a polynomial in the square root, since gathering from a table takes three times as long.
HWY_INLINE IntVector srgb_bytes(Vector linear) {
    const Floats d;
    const Vector light = hn::Min(hn::Max(linear, hn::Zero(d)), hn::Set(d, 1.0F));
    const Vector root = hn::Sqrt(light);
    Vector sum = hn::Set(d, -148.989026F);
    for (const float term : {573.367261F, -905.950652F, 773.317176F, -419.630939F, 393.295773F, -10.4203252F})
        sum = hn::Add(hn::Mul(sum, root), hn::Set(d, term));
    constexpr float kDark = 0.0031308F; // below it sRGB is a multiple of linear light
    const Vector dark = hn::Mul(light, hn::Set(d, 255 * 12.92F));
    const Vector bytes = hn::IfThenElse(hn::Lt(light, hn::Set(d, kDark)), dark, sum);
    constexpr float kWhole =
        1 << 23; // floats have no fraction from here on: the lowest bits are the nearest whole number
    return hn::And(hn::BitCast(Ints(), hn::Add(bytes, hn::Set(d, kWhole))), hn::Set(Ints(), 255));
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
