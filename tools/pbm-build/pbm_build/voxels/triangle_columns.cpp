#include "pbm_build/voxels/triangle_columns.h"

#include "pbm_build/voxels/triangle_voxels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/voxels/triangle_columns.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// A bound closer than kClose to a voxel's border is left to visit_voxels. Bounds in single precision, from corners that
// it represents exactly, are accurate to 2^-17 of a voxel; those of visit_voxels to 2^-34, times up to 2^18 at steep
// edges.
constexpr float kClose = 0x1p-14F;
constexpr float kFar = 1e9F; // beyond all bounds

using Tag = hn::CappedTag<float, 8>;
using Lanes = hn::Vec<Tag>;
using Row = std::array<float, kSmallTriangle>; // [slab] or [column]

struct Bounds {
    HWY_ALIGN Row low, high;
};

// An edge as a function of one of its coordinates, `from` to `to`.
struct Edge {
    float from, to;   // from <= to
    float at;         // the coordinate of its first corner
    float reciprocal; // 1 / (last corner - first corner); an edge with an infinite one is never entered
};
HWY_INLINE Edge edge_of(float start, float end) {
    return {std::min(start, end), std::max(start, end), start, 1 / (end - start)};
}

// first, first + 1, ...: Iota of Highway 1.0 is slow for an argument that is no constant.
HWY_INLINE Lanes count_from(std::size_t first) {
    const Tag d;
    return hn::Add(hn::Set(d, static_cast<float>(first)), hn::Iota(d, 0.0F));
}

// The part of an edge within the slab of each lane, which begins at `slab`.
struct Part {
    Lanes first, last; // relative to the edge's first corner
    hn::Mask<Tag> is_there;
};
HWY_INLINE Part part_of(const Edge &edge, Lanes slab) {
    const Tag d;
    const auto from = hn::Set(d, edge.from), to = hn::Set(d, edge.to), at = hn::Set(d, edge.at);
    const auto first = hn::Min(hn::Max(slab, from), to);
    const auto last = hn::Min(hn::Max(hn::Add(slab, hn::Set(d, 1)), from), to);
    return {hn::Sub(first, at), hn::Sub(last, at), hn::Lt(first, last)};
}

// Extends low..high by the values of that part: `start` at the edge's first corner, rising by `step`.
HWY_INLINE void add_part(const Part &part, float start, float step, Lanes &low, Lanes &high) {
    const Tag d;
    const auto first = hn::Add(hn::Set(d, start), hn::Mul(part.first, hn::Set(d, step)));
    const auto last = hn::Add(hn::Set(d, start), hn::Mul(part.last, hn::Set(d, step)));
    low = hn::Min(low, hn::IfThenElse(part.is_there, hn::Min(first, last), low));
    high = hn::Max(high, hn::IfThenElse(part.is_there, hn::Max(first, last), high));
}

HWY_INLINE hn::Mask<Tag> is_close(Lanes at, Lanes whole) {
    const Tag d;
    const auto above = hn::Sub(at, whole);
    return hn::Or(hn::Lt(above, hn::Set(d, kClose)), hn::Gt(above, hn::Set(d, 1 - kClose)));
}

// Corners relative to the triangle's first voxel, in voxels, and its plane.
struct SmallTriangle {
    std::array<float, 3> u, v, w;
    float u_step, v_step, origin; // height of the plane: origin + u * u_step + v * v_step
    std::size_t slabs, columns;
};

// Voxels of its columns: [slab][column].
struct Columns {
    HWY_ALIGN std::array<std::array<std::int32_t, kSmallTriangle>, kSmallTriangle> first;
    HWY_ALIGN std::array<std::array<std::int32_t, kSmallTriangle>, kSmallTriangle> count; // 0 to 3
};

// False if a bound is close to a voxel's border; `columns` is within bounds in any case.
bool find_columns(const SmallTriangle &t, Columns &columns) {
    const Tag d;
    const hn::RebindToSigned<Tag> di;
    const std::size_t lanes = hn::Lanes(d);
    std::array<Edge, 3> along_u, along_v;
    for (std::size_t p = 0; p < 3; ++p) {
        const std::size_t q = p == 2 ? 0 : p + 1;
        along_u[p] = edge_of(t.u[p], t.u[q]);
        along_v[p] = edge_of(t.v[p], t.v[q]);
    }
    Bounds slab_v, slab_w, column_w;
    auto close = hn::Lt(hn::Zero(d), hn::Zero(d));
    const auto far = hn::Set(d, kFar), before = hn::Set(d, -kFar);
    for (std::size_t at = 0; at < t.slabs; at += lanes) {
        const auto slab = count_from(at);
        auto v_low = far, v_high = before, w_low = far, w_high = before;
        for (std::size_t p = 0; p < 3; ++p) {
            const std::size_t q = p == 2 ? 0 : p + 1;
            const Part part = part_of(along_u[p], slab);
            add_part(part, t.v[p], (t.v[q] - t.v[p]) * along_u[p].reciprocal, v_low, v_high);
            add_part(part, t.w[p], (t.w[q] - t.w[p]) * along_u[p].reciprocal, w_low, w_high);
        }
        const auto is_slab = hn::Lt(slab, hn::Set(d, static_cast<float>(t.slabs)));
        close = hn::Or(
            close, hn::And(is_slab, hn::Or(is_close(v_low, hn::Floor(v_low)), is_close(v_high, hn::Floor(v_high)))));
        hn::Store(v_low, d, &slab_v.low[at]);
        hn::Store(v_high, d, &slab_v.high[at]);
        hn::Store(w_low, d, &slab_w.low[at]);
        hn::Store(w_high, d, &slab_w.high[at]);
    }
    for (std::size_t at = 0; at < t.columns; at += lanes) {
        const auto column = count_from(at);
        auto w_low = far, w_high = before;
        for (std::size_t p = 0; p < 3; ++p) {
            const std::size_t q = p == 2 ? 0 : p + 1;
            add_part(part_of(along_v[p], column), t.w[p], (t.w[q] - t.w[p]) * along_v[p].reciprocal, w_low, w_high);
        }
        hn::Store(w_low, d, &column_w.low[at]);
        hn::Store(w_high, d, &column_w.high[at]);
    }
    // Over a column the plane spans `below` to `above`, relative to its height at the column's corner at the origin.
    const auto below = hn::Set(d, std::min(t.u_step, 0.0F) + std::min(t.v_step, 0.0F));
    const auto above = hn::Set(d, std::max(t.u_step, 0.0F) + std::max(t.v_step, 0.0F));
    const auto zero = hn::Zero(d), one = hn::Set(d, 1);
    for (std::size_t i = 0; i < t.slabs; ++i)
        for (std::size_t at = 0; at < t.columns; at += lanes) {
            const auto column = count_from(at);
            const auto is_column = hn::And(hn::Gt(hn::Add(column, one), hn::Set(d, slab_v.low[i])),
                                           hn::Lt(column, hn::Set(d, slab_v.high[i])));
            const auto plane =
                hn::Add(hn::Set(d, t.origin + static_cast<float>(i) * t.u_step), hn::Mul(column, hn::Set(d, t.v_step)));
            const auto low =
                hn::Max(hn::Max(hn::Set(d, slab_w.low[i]), hn::Load(d, &column_w.low[at])), hn::Add(plane, below));
            const auto high =
                hn::Min(hn::Min(hn::Set(d, slab_w.high[i]), hn::Load(d, &column_w.high[at])), hn::Add(plane, above));
            const auto first = hn::Floor(low), last = hn::Floor(high);
            close = hn::Or(close, hn::And(is_column, hn::Or(is_close(low, first), is_close(high, last))));
            const auto count = hn::Min(hn::Max(hn::Add(hn::Sub(last, first), one), zero), hn::Set(d, 3));
            const auto within = hn::Min(hn::Max(first, zero), hn::Set(d, 2 * kSmallTriangle));
            hn::Store(hn::ConvertTo(di, hn::IfThenElseZero(is_column, within)), di, &columns.first[i][at]);
            hn::Store(hn::ConvertTo(di, hn::IfThenElseZero(is_column, count)), di, &columns.count[i][at]);
        }
    return hn::AllFalse(d, close);
}

std::size_t find_small_triangle(const std::array<LatticePoint, 3> &corners, const glm::dvec3 &normal, int depth_axis,
                                SmallTriangleCodes &codes) {
    constexpr int kInVoxel = (1 << kLatticeBits) - 1;
    constexpr float kVoxels = 1 / static_cast<float>(kLatticeSteps);
    const int u = (depth_axis + 1) % 3, v = (depth_axis + 2) % 3;
    LatticePoint first = corners[0], last = corners[0];
    bool close = normal[depth_axis] == 0;
    for (const LatticePoint &c : corners) {
        close |= ((c.x & kInVoxel) == 0) | ((c.y & kInVoxel) == 0) | ((c.z & kInVoxel) == 0);
        for (int axis = 0; axis < 3; ++axis) {
            first[axis] = std::min(first[axis], c[axis]);
            last[axis] = std::max(last[axis], c[axis]);
        }
    }
    first = voxel_of(first);
    const glm::ivec3 size = voxel_of(last) - first + 1;
    constexpr int kMax = kSmallTriangle;
    if (close || size[u] > kMax || size[v] > kMax)
        return 0;

    SmallTriangle t;
    for (std::size_t c = 0; c < 3; ++c) {
        const LatticePoint at = corners[c] - first * (1 << kLatticeBits);
        t.u[c] = static_cast<float>(at[u]) * kVoxels;
        t.v[c] = static_cast<float>(at[v]) * kVoxels;
        t.w[c] = static_cast<float>(at[depth_axis]) * kVoxels;
    }
    const double down = -1 / normal[depth_axis], u_step = normal[u] * down, v_step = normal[v] * down;
    t.u_step = static_cast<float>(u_step);
    t.v_step = static_cast<float>(v_step);
    t.origin = static_cast<float>(t.w[0] - t.u[0] * u_step - t.v[0] * v_step);
    t.slabs = static_cast<std::size_t>(size[u]);
    t.columns = static_cast<std::size_t>(size[v]);
    Columns columns;
    if (!find_columns(t, columns))
        return 0;

    // The triangle is at most as high as it is wide in both directions; two spare layers follow.
    std::array<MortonCode, 2 * kSmallTriangle + 3> layer_codes{};
    MortonAxis layer(depth_axis, first[depth_axis]);
    for (std::size_t k = 0; k < static_cast<std::size_t>(size[depth_axis]); ++k, layer.step())
        layer_codes[k] = layer.code();
    std::size_t count = 0;
    MortonAxis slab(u, first[u]);
    const MortonAxis first_column(v, first[v]);
    for (std::size_t i = 0; i < t.slabs; ++i, slab.step()) {
        MortonAxis column = first_column;
        for (std::size_t j = 0; j < t.columns; ++j, column.step()) {
            const MortonCode *from = &layer_codes[static_cast<std::size_t>(columns.first[i][j])];
            const MortonCode across = slab.code() | column.code();
            for (std::size_t k = 0; k < 3; ++k)
                codes[count + k] = across | from[k];
            count += static_cast<std::size_t>(columns.count[i][j]);
        }
    }
    return count;
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(find_small_triangle);

std::size_t find_small_triangle(const std::array<LatticePoint, 3> &corners, const glm::dvec3 &normal, int depth_axis,
                                SmallTriangleCodes &codes) {
    return HWY_DYNAMIC_DISPATCH(find_small_triangle)(corners, normal, depth_axis, codes);
}

} // namespace pbm::build
#endif // HWY_ONCE
