#include "pbm_build/normals/plane_columns.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/normals/plane_columns.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#ifndef PBM_PLANE_COLUMNS_CONSTANTS // once for all targets
#define PBM_PLANE_COLUMNS_CONSTANTS
namespace pbm::build {

inline constexpr double kFarthestLoss = 0.75; // of its weight
inline constexpr double kWideGap = 0.75;      // squared cosine of 150 degrees
inline constexpr double kLine = 1e-4;         // of the largest moment: below, the middle one is that of a line

} // namespace pbm::build
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 8>;
using IntTag = hn::Rebind<std::int32_t, Tag>;
using FloatTag = hn::Rebind<float, Tag>;
using Doubles = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
using Planes = PlaneColumns::Planes;

HWY_INLINE Doubles set(double value) { return hn::Set(Tag(), value); }

struct Vector {
    Doubles x, y, z;
};
HWY_INLINE Doubles dot(const Vector &a, const Vector &b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vector scaled(const Vector &v, Doubles factor) {
    return {hn::Mul(v.x, factor), hn::Mul(v.y, factor), hn::Mul(v.z, factor)};
}
HWY_INLINE Vector difference(const Vector &a, const Vector &b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

HWY_INLINE Vector load(const PlaneColumns::Vectors<std::int32_t> &from, std::size_t row) {
    const IntTag di;
    const auto axis = [&](std::size_t a) { return hn::PromoteTo(Tag(), hn::Load(di, &from[a][row])); };
    return {axis(0), axis(1), axis(2)};
}
HWY_INLINE Vector load(const PlaneColumns::Vectors<double> &from, std::size_t row) {
    const auto axis = [&](std::size_t a) { return hn::Load(Tag(), &from[a][row]); };
    return {axis(0), axis(1), axis(2)};
}
HWY_INLINE void store(const Vector &v, PlaneColumns::Vectors<double> &to, std::size_t row) {
    hn::Store(v.x, Tag(), &to[0][row]);
    hn::Store(v.y, Tag(), &to[1][row]);
    hn::Store(v.z, Tag(), &to[2][row]);
}

// A symmetric matrix, and the matrix whose columns become its eigenvectors.
struct Eigen {
    Doubles xx, yy, zz, xy, xz, yz;
    Vector a, b, c; // columns
};

// Rotates the axes p and q of `some` lanes so that the element pq becomes zero. r is the third axis.
HWY_INLINE void rotate(Mask some, Doubles &pp, Doubles &qq, Doubles &pq, Doubles &pr, Doubles &qr, Vector &p,
                       Vector &q) {
    const auto zero = set(0), one = set(1);
    some = hn::And(some, hn::Ne(pq, zero));
    const auto theta = hn::Div(hn::Sub(qq, pp), hn::Mul(set(2), pq));
    const auto sign = hn::IfThenElse(hn::Lt(theta, zero), set(-1), one);
    const auto t = hn::Div(sign, hn::Add(hn::Abs(theta), hn::Sqrt(hn::Add(hn::Mul(theta, theta), one))));
    const auto c = hn::Div(one, hn::Sqrt(hn::Add(hn::Mul(t, t), one))), s = hn::Mul(t, c);
    const auto turn = [&](Doubles &x, Doubles &y) {
        const auto old = x;
        x = hn::IfThenElse(some, hn::Sub(hn::Mul(c, old), hn::Mul(s, y)), old);
        y = hn::IfThenElse(some, hn::Add(hn::Mul(s, old), hn::Mul(c, y)), y);
    };
    pp = hn::IfThenElse(some, hn::Sub(pp, hn::Mul(t, pq)), pp);
    qq = hn::IfThenElse(some, hn::Add(qq, hn::Mul(t, pq)), qq);
    pq = hn::IfThenElse(some, zero, pq);
    turn(pr, qr);
    turn(p.x, q.x);
    turn(p.y, q.y);
    turn(p.z, q.z);
}

// Eigenvectors of a symmetric matrix, eigenvalues on its diagonal.
// Based on: Golub, Van Loan. Matrix Computations. Section 8.5, cyclic Jacobi rotations
HWY_INLINE void diagonalise(Eigen &m) {
    const auto zero = set(0), one = set(1);
    m.a = {one, zero, zero};
    m.b = {zero, one, zero};
    m.c = {zero, zero, one};
    constexpr int kMaxSweeps = 12; // convergence is quadratic: 4 or 5 do
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
        const auto off = hn::Add(hn::Add(hn::Abs(m.xy), hn::Abs(m.xz)), hn::Abs(m.yz));
        const auto rest = hn::Gt(off, hn::Mul(set(1e-14), hn::Add(hn::Add(m.xx, m.yy), m.zz)));
        if (hn::AllFalse(Tag(), rest))
            return;
        rotate(rest, m.xx, m.yy, m.xy, m.xz, m.yz, m.a, m.b);
        rotate(rest, m.xx, m.zz, m.xz, m.xy, m.yz, m.a, m.c);
        rotate(rest, m.yy, m.zz, m.yz, m.xy, m.xz, m.b, m.c);
    }
}

HWY_INLINE Doubles chosen(Mask second, Mask third, Doubles a, Doubles b, Doubles c) {
    return hn::IfThenElse(third, c, hn::IfThenElse(second, b, a));
}
HWY_INLINE Vector chosen(Mask second, Mask third, const Vector &a, const Vector &b, const Vector &c) {
    return {chosen(second, third, a.x, b.x, c.x), chosen(second, third, a.y, b.y, c.y),
            chosen(second, third, a.z, b.z, c.z)};
}

void fit_rows(const PlaneColumns &columns, std::size_t count, std::size_t row, Planes &planes) {
    const Tag d;
    const auto zero = set(0), one = set(1);
    const Vector last = load(columns.offsets[count - 1], row);
    const auto reach = dot(last, last);
    const auto farthest = hn::IfThenElse(hn::Gt(reach, zero), reach, one);
    const auto scale = hn::Div(one, hn::Sqrt(farthest));
    alignas(64) std::array<std::array<double, hn::MaxLanes(d)>, kMaxNeighbours> weights;
    auto sum = one; // the weight of the point itself, at offset 0
    Vector mean{zero, zero, zero};
    for (std::size_t k = 0; k < count; ++k) {
        const Vector offset = load(columns.offsets[k], row);
        const auto weight = hn::Sub(one, hn::Mul(set(kFarthestLoss), hn::Div(dot(offset, offset), farthest)));
        hn::Store(weight, d, weights[k].data());
        sum = hn::Add(sum, weight);
        const Vector v = scaled(offset, scale);
        mean = {hn::Add(mean.x, hn::Mul(weight, v.x)), hn::Add(mean.y, hn::Mul(weight, v.y)),
                hn::Add(mean.z, hn::Mul(weight, v.z))};
    }
    mean = {hn::Div(mean.x, sum), hn::Div(mean.y, sum), hn::Div(mean.z, sum)};
    Eigen m{hn::Mul(mean.x, mean.x),
            hn::Mul(mean.y, mean.y),
            hn::Mul(mean.z, mean.z),
            hn::Mul(mean.x, mean.y),
            hn::Mul(mean.x, mean.z),
            hn::Mul(mean.y, mean.z),
            mean,
            mean,
            mean};
    for (std::size_t k = 0; k < count; ++k) {
        const Vector v = difference(scaled(load(columns.offsets[k], row), scale), mean);
        const Vector w = scaled(v, hn::Load(d, weights[k].data()));
        m.xx = hn::Add(m.xx, hn::Mul(w.x, v.x));
        m.xy = hn::Add(m.xy, hn::Mul(w.x, v.y));
        m.xz = hn::Add(m.xz, hn::Mul(w.x, v.z));
        m.yy = hn::Add(m.yy, hn::Mul(w.y, v.y));
        m.yz = hn::Add(m.yz, hn::Mul(w.y, v.z));
        m.zz = hn::Add(m.zz, hn::Mul(w.z, v.z));
    }
    diagonalise(m);

    // The first of equal least moments and the last of equal largest ones.
    const auto y_less = hn::Lt(m.yy, m.xx), y_more = hn::Ge(m.yy, m.xx);
    const auto z_least = hn::Lt(m.zz, hn::Min(m.xx, m.yy)), z_most = hn::Ge(m.zz, hn::Max(m.xx, m.yy));
    const auto least = hn::Min(hn::Min(m.xx, m.yy), m.zz), most = hn::Max(hn::Max(m.xx, m.yy), m.zz);
    const auto middle = hn::Max(hn::Min(m.xx, m.yy), hn::Min(hn::Max(m.xx, m.yy), m.zz));
    const auto is_plane = hn::And(hn::Gt(middle, hn::Mul(set(kLine), most)), hn::Gt(reach, zero));
    const auto keep = [&](const Vector &v) {
        return Vector{hn::IfThenElseZero(is_plane, v.x), hn::IfThenElseZero(is_plane, v.y),
                      hn::IfThenElseZero(is_plane, v.z)};
    };
    store(keep(chosen(y_less, z_least, m.a, m.b, m.c)), planes.normals, row);
    store(keep(chosen(y_more, z_most, m.a, m.b, m.c)), planes.along, row);
    hn::Store(hn::IfThenElse(is_plane, hn::Div(hn::Max(zero, least), middle), one), d, &planes.roughness[row]);
    hn::Store(hn::IfThenElseZero(is_plane, hn::Div(middle, most)), d, &planes.breadth[row]);
}

void fit_lanes(const PlaneColumns &columns, std::size_t count, Planes &planes) {
    for (std::size_t row = 0; row < PlaneColumns::kRows; row += hn::Lanes(Tag()))
        fit_rows(columns, count, row, planes);
}

void find_borders_lanes(const PlaneColumns &columns, std::size_t count, const Planes &planes,
                        PlaneColumns::Column<std::uint8_t> &at_border) {
    const Tag d;
    struct Direction {
        Doubles x, y, squared, wide;
    };
    for (std::size_t row = 0; row < PlaneColumns::kRows; row += hn::Lanes(d)) {
        const Vector n = load(planes.normals, row), u = load(planes.along, row);
        const Vector v{hn::Sub(hn::Mul(n.y, u.z), hn::Mul(n.z, u.y)), hn::Sub(hn::Mul(n.z, u.x), hn::Mul(n.x, u.z)),
                       hn::Sub(hn::Mul(n.x, u.y), hn::Mul(n.y, u.x))};
        std::array<Direction, kMinNeighbours> at;
        std::array<Mask, kMinNeighbours> has_next;
        for (std::size_t k = 0; k < count; ++k) {
            const Vector e = load(columns.offsets[k], row);
            const auto x = dot(e, u), y = dot(e, v);
            const auto squared = hn::Add(hn::Mul(x, x), hn::Mul(y, y));
            at[k] = {x, y, squared, hn::Mul(set(kWideGap), squared)};
            has_next[k] = hn::MaskFromVec(set(0));
        }
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = 0; j < i; ++j) {
                const Direction &a = at[i], &b = at[j];
                const auto inner = hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y));
                const auto left = hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x)), squared = hn::Mul(inner, inner);
                const auto acute = hn::Ge(inner, set(0));
                const auto b_follows = hn::Or(acute, hn::Lt(squared, hn::Mul(a.wide, b.squared)));
                const auto a_follows = hn::Or(acute, hn::Lt(squared, hn::Mul(b.wide, a.squared)));
                has_next[i] = hn::Or(has_next[i], hn::And(b_follows, hn::Gt(left, set(0))));
                has_next[j] = hn::Or(has_next[j], hn::And(a_follows, hn::Lt(left, set(0))));
            }
        auto all = hn::Eq(set(0), set(0));
        for (std::size_t k = 0; k < count; ++k)
            all = hn::And(all, has_next[k]);
        alignas(64) std::array<double, hn::MaxLanes(d)> border;
        hn::Store(hn::IfThenElse(all, set(0), set(1)), d, border.data());
        for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane)
            at_border[row + lane] = static_cast<std::uint8_t>(border[lane]);
    }
}

void measure_lanes(const PlaneColumns &columns, std::size_t count, PlaneColumns::Column<float> &spacing) {
    const Tag d;
    for (std::size_t row = 0; row < PlaneColumns::kRows; row += hn::Lanes(d)) {
        auto sum = set(0);
        for (std::size_t k = 0; k < count; ++k) {
            const Vector offset = load(columns.offsets[k], row);
            sum = hn::Add(sum, hn::Sqrt(dot(offset, offset)));
        }
        const auto mean = hn::Div(sum, set(static_cast<double>(std::max<std::size_t>(1, count))));
        hn::StoreU(hn::DemoteTo(FloatTag(), mean), FloatTag(), &spacing[row]);
    }
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(fit_lanes);
HWY_EXPORT(find_borders_lanes);
HWY_EXPORT(measure_lanes);

void PlaneColumns::fit(std::size_t count, Planes &planes) const {
    HWY_DYNAMIC_DISPATCH(fit_lanes)(*this, count, planes);
}

void PlaneColumns::find_borders(std::size_t count, const Planes &planes, Column<std::uint8_t> &at_border) const {
    HWY_DYNAMIC_DISPATCH(find_borders_lanes)(*this, count, planes, at_border);
}

void PlaneColumns::measure(std::size_t count, Column<float> &spacing) const {
    HWY_DYNAMIC_DISPATCH(measure_lanes)(*this, count, spacing);
}

} // namespace pbm::build
#endif // HWY_ONCE
