#include "pbm_build/voxels/triangle_mix.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/voxels/triangle_mix.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, NormalColumns::kSpare>;
using IntTag = hn::Rebind<std::int32_t, Tag>;
using Lanes = hn::Vec<Tag>;
using Three = TriangleMix::Three;

HWY_INLINE Lanes set(double value) { return hn::Set(Tag(), value); }

struct Point {
    Lanes x, y, z;
};
HWY_INLINE Point difference(const Point &a, const glm::dvec3 &b) {
    return {hn::Sub(a.x, set(b.x)), hn::Sub(a.y, set(b.y)), hn::Sub(a.z, set(b.z))};
}
HWY_INLINE Lanes dot(const glm::dvec3 &a, const Point &b) {
    return hn::Add(hn::Add(hn::Mul(set(a.x), b.x), hn::Mul(set(a.y), b.y)), hn::Mul(set(a.z), b.z));
}

struct Weights {
    Lanes a, b, c;
};

// Barycentric weights of the triangle's point nearest to p, the centre of a voxel that the triangle passes through.
HWY_INLINE Weights nearest(const TriangleMix &t, const Point &p) {
    const Point ap = difference(p, t.corners[0]);
    const auto d1 = dot(t.ab, ap), d2 = dot(t.ac, ap);
    auto d3 = hn::Sub(d1, set(t.ab_ab)), d4 = hn::Sub(d2, set(t.ab_ac));
    auto d5 = hn::Sub(d1, set(t.ab_ac)), d6 = hn::Sub(d2, set(t.ac_ac));
    if (!t.exact) {
        const Point bp = difference(p, t.corners[1]), cp = difference(p, t.corners[2]);
        d3 = dot(t.ab, bp);
        d4 = dot(t.ac, bp);
        d5 = dot(t.ab, cp);
        d6 = dot(t.ac, cp);
    }
    const auto zero = set(0), one = set(1);
    const auto vc = hn::Sub(hn::Mul(d1, d4), hn::Mul(d3, d2)), vb = hn::Sub(hn::Mul(d5, d2), hn::Mul(d1, d6)),
               va = hn::Sub(hn::Mul(d3, d6), hn::Mul(d5, d4));
    const auto d43 = hn::Sub(d4, d3), d56 = hn::Sub(d5, d6), along_bc = hn::Add(d43, d56);
    const auto along_ab = hn::Sub(d1, d3), along_ac = hn::Sub(d2, d6), area = hn::Add(hn::Add(va, vb), vc);
    const auto both = [](auto x, auto y) { return hn::And(x, y); };
    const auto on_ab = both(both(hn::Le(vc, zero), hn::Ge(d1, zero)), both(hn::Le(d3, zero), hn::Gt(d1, d3)));
    const auto on_ac = both(both(hn::Le(vb, zero), hn::Ge(d2, zero)), both(hn::Le(d6, zero), hn::Gt(d2, d6)));
    const auto on_bc = both(both(hn::Le(va, zero), hn::Ge(d43, zero)), both(hn::Ge(d56, zero), hn::Gt(along_bc, zero)));
    // A sliver below the precision of the arithmetic.
    const auto no_area =
        hn::Or(hn::Or(hn::Le(area, zero), hn::Lt(va, zero)), hn::Or(hn::Lt(vb, zero), hn::Lt(vc, zero)));

    // Cases from last to first, so that the first applicable one wins. Edges and interior share one division.
    auto part = vb, whole = area;
    const auto choose_edge = [&](auto here, Lanes edge_part, Lanes edge_whole) {
        part = hn::IfThenElse(here, edge_part, part);
        whole = hn::IfThenElse(here, edge_whole, whole);
    };
    choose_edge(on_bc, d43, along_bc);
    choose_edge(on_ac, d2, along_ac);
    choose_edge(on_ab, d1, along_ab);
    const auto t_edge = hn::Div(part, whole), rest = hn::Sub(one, t_edge), third = set(1.0 / 3);
    Weights w{hn::Div(va, area), t_edge, hn::Div(vc, area)};
    const auto choose = [&](auto here, Lanes a, Lanes b, Lanes c) {
        w = {hn::IfThenElse(here, a, w.a), hn::IfThenElse(here, b, w.b), hn::IfThenElse(here, c, w.c)};
    };
    choose(no_area, third, third, third);
    choose(on_bc, zero, rest, t_edge);
    choose(on_ac, rest, zero, t_edge);
    choose(on_ab, rest, t_edge, zero);
    choose(both(hn::Ge(d6, zero), hn::Le(d5, d6)), zero, zero, one);
    choose(both(hn::Ge(d3, zero), hn::Le(d4, d3)), zero, one, zero);
    choose(both(hn::Le(d1, zero), hn::Le(d2, zero)), one, zero, zero);
    return w;
}

HWY_INLINE Lanes mixed(const Weights &w, const Three &values) {
    return hn::Add(hn::Add(hn::Mul(w.a, set(values[0])), hn::Mul(w.b, set(values[1]))), hn::Mul(w.c, set(values[2])));
}
HWY_INLINE Lanes mixed_and_half(const Weights &w, const Three &values) {
    const auto first = hn::Add(set(0.5), hn::Mul(w.a, set(values[0])));
    return hn::Add(hn::Add(first, hn::Mul(w.b, set(values[1]))), hn::Mul(w.c, set(values[2])));
}

void mix_triangle(const TriangleMix &t, const glm::dvec3 &block_centre, std::size_t first, std::size_t end,
                  MixedRows &rows) {
    const Tag d;
    const IntTag di;
    const auto axis_of = [&](auto places) { return hn::PromoteTo(d, hn::And(places, hn::Set(di, 255))); };
    for (std::size_t row = first; row < end; row += hn::Lanes(d)) {
        Weights w{set(1.0 / 3), set(1.0 / 3), set(1.0 / 3)};
        if (!t.in_one_voxel) {
            const auto places = hn::LoadU(di, &rows.places[row]);
            w = nearest(t, {hn::Add(axis_of(places), set(block_centre.x)),
                            hn::Add(axis_of(hn::ShiftRight<8>(places)), set(block_centre.y)),
                            hn::Add(axis_of(hn::ShiftRight<16>(places)), set(block_centre.z))});
        }
        hn::StoreU(w.a, d, &rows.weights[0][row]);
        hn::StoreU(w.b, d, &rows.weights[1][row]);
        hn::StoreU(w.c, d, &rows.weights[2][row]);
        for (std::size_t axis = 0; axis < 3; ++axis)
            hn::StoreU(t.is_flat ? set(t.flat[axis]) : mixed(w, t.normals[axis]), d, &rows.normals.from[axis][row]);
        hn::StoreU(set(t.is_flat ? 1 : 0), d, &rows.normals.is_rounded[row]);
        for (std::size_t channel = 0; channel < 3 && t.has_colour; ++channel) {
            const auto clamped = hn::Min(hn::Max(mixed_and_half(w, t.colours[channel]), set(0)), set(65535));
            hn::StoreU(hn::DemoteTo(di, clamped), di, &rows.colours[channel][row]);
        }
    }
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(mix_triangle);

void TriangleMix::set_corners(const std::array<glm::dvec3, 3> &at) {
    // Products of differences of lattice points within 2,000 voxels are multiples of 2^-28 below 2^25: sums are exact.
    constexpr double kMaxVoxels = 1900;
    corners = at;
    ab = at[1] - at[0];
    ac = at[2] - at[0];
    const glm::dvec3 longest = glm::max(glm::max(glm::abs(ab), glm::abs(ac)), glm::abs(at[2] - at[1]));
    exact = std::max({longest.x, longest.y, longest.z}) < kMaxVoxels;
    ab_ab = glm::dot(ab, ab);
    ab_ac = glm::dot(ab, ac);
    ac_ac = glm::dot(ac, ac);
}

void TriangleMix::mix(const glm::dvec3 &block_centre, std::size_t first, std::size_t end, MixedRows &rows) const {
    HWY_DYNAMIC_DISPATCH(mix_triangle)(*this, block_centre, first, end, rows);
}

} // namespace pbm::build
#endif // HWY_ONCE
