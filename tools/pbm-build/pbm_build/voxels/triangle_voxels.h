// All voxels that a triangle passes through.
// Based on: Sutherland, Hodgman. Reentrant polygon clipping. 1974
// Based on: Schrack. Finding Neighbors of Equal Size in Linear Quadtrees and Octrees in Constant Time. 1992 (a step
// along one axis of a Morton code)
#pragma once

#include "pbm_format/model/octree.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace pbm::build {

// A convex polygon. A triangle has at most seven corners after four cuts. Rounding may give a sliver a few more;
// corners beyond the capacity are dropped, since they lie on the others.
template <class Corner> struct Outline {
    std::array<Corner, 10> corners;
    std::size_t size = 0;

    void add(const Corner &corner) {
        if (size < corners.size())
            corners[size++] = corner;
    }
};

// Coordinates in the order of the cuts, and those that remain after the first cut.
struct SlabCorner {
    double u, v, w;
};
struct ColumnCorner {
    double v, w;
};

// The range of one coordinate over some corners.
struct CoordinateRange {
    double low = HUGE_VAL, high = -HUGE_VAL;

    void add(double at) {
        low = std::min(low, at);
        high = std::max(high, at);
    }
    // The voxels that the range overlaps, at least one. A voxel that the range only touches does not count, so that a
    // face at a voxel boundary makes one layer. Coordinates are not negative.
    int first() const { return static_cast<int>(low); }
    int last() const {
        const int whole = static_cast<int>(high);
        return std::max(first(), whole - (static_cast<double>(whole) < high ? 0 : 1));
    }
};

// Cuts at u = at: `below` gets the part with u <= at, `above` the part with u >= at.
inline void cut_slab(const Outline<SlabCorner> &from, double at, Outline<ColumnCorner> &below,
                     Outline<SlabCorner> &above) {
    below.size = above.size = 0;
    for (std::size_t i = 0; i < from.size; ++i) {
        const SlabCorner &p = from.corners[i], &q = from.corners[i + 1 == from.size ? 0 : i + 1];
        if (p.u <= at)
            below.add({p.v, p.w});
        if (p.u >= at)
            above.add(p);
        if ((p.u < at && q.u > at) || (p.u > at && q.u < at)) {
            const double t = (at - p.u) / (q.u - p.u), v = p.v + t * (q.v - p.v), w = p.w + t * (q.w - p.w);
            below.add({v, w});
            above.add({at, v, w});
        }
    }
}

// Cuts at v = at: `above` gets the part with v >= at; returns the range of w of the part below.
inline CoordinateRange cut_column(const Outline<ColumnCorner> &from, double at, Outline<ColumnCorner> &above) {
    Outline<ColumnCorner> below;
    CoordinateRange range;
    above.size = 0;
    const auto add_below = [&](double w) {
        if (below.size < below.corners.size()) {
            ++below.size;
            range.add(w);
        }
    };
    for (std::size_t i = 0; i < from.size; ++i) {
        const ColumnCorner &p = from.corners[i], &q = from.corners[i + 1 == from.size ? 0 : i + 1];
        if (p.v <= at)
            add_below(p.w);
        if (p.v >= at)
            above.add(p);
        if ((p.v < at && q.v > at) || (p.v > at && q.v < at)) {
            const double t = (at - p.v) / (q.v - p.v), w = p.w + t * (q.w - p.w);
            add_below(w);
            above.add({at, w});
        }
    }
    return range;
}

template <class Corner> CoordinateRange range_of(const Outline<Corner> &outline, double Corner::*axis) {
    CoordinateRange range;
    for (std::size_t i = 0; i < outline.size; ++i)
        range.add(outline.corners[i].*axis);
    return range;
}

// The part of a triangle in one voxel.
struct TrianglePiece {
    double area = 0;       // voxel edges^2
    glm::dvec3 centroid{}; // from the centre of the voxel, voxel edges; of no area: not set
};

// `corners` from the centre of the voxel, voxel edges.
inline TrianglePiece piece_in_voxel(const std::array<glm::dvec3, 3> &corners) {
    Outline<glm::dvec3> outlines[2];
    Outline<glm::dvec3> *from = &outlines[0], *to = &outlines[1];
    for (const glm::dvec3 &corner : corners)
        from->add(corner);
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
            to->size = 0;
            for (std::size_t i = 0; i < from->size; ++i) {
                const glm::dvec3 &p = from->corners[i], &q = from->corners[i + 1 == from->size ? 0 : i + 1];
                const double p_out = side * p[axis] - 0.5, q_out = side * q[axis] - 0.5;
                if (p_out <= 0)
                    to->add(p);
                if ((p_out < 0 && q_out > 0) || (p_out > 0 && q_out < 0))
                    to->add(p + (q - p) * (p_out / (p_out - q_out)));
            }
            std::swap(from, to);
        }
    TrianglePiece piece;
    glm::dvec3 sum(0);
    for (std::size_t i = 2; i < from->size; ++i) {
        const glm::dvec3 &a = from->corners[0], &b = from->corners[i - 1], &c = from->corners[i];
        const double area = glm::length(glm::cross(b - a, c - a)) / 2;
        piece.area += area;
        sum += (a + b + c) * (area / 3);
    }
    if (piece.area > 0)
        piece.centroid = sum / piece.area;
    return piece;
}

// One coordinate of a Morton code whose two others are zero.
class MortonAxis {
  public:
    MortonAxis(int axis, int voxel)
        : mask_(spread_bits(~0U) << axis), code_(spread_bits(static_cast<std::uint32_t>(voxel)) << axis) {}
    MortonCode code() const { return code_; }
    void step() { code_ = ((code_ | ~mask_) + 1) & mask_; } // the carry passes the other axes' bits

  private:
    MortonCode mask_, code_;
};

// Calls visit(code) for every voxel whose interior the triangle enters; these voxels cover the triangle. `corners` in
// voxel units, none negative. `depth_axis`: the axis closest to the triangle's normal. The triangle is cut into columns
// along it, where each piece is short.
template <class Visit> void visit_voxels(const std::array<glm::dvec3, 3> &corners, int depth_axis, Visit &&visit) {
    const int u = (depth_axis + 1) % 3, v = (depth_axis + 2) % 3;
    Outline<SlabCorner> slabs[2];
    Outline<ColumnCorner> columns[2];
    for (const glm::dvec3 &corner : corners)
        slabs[0].add({corner[u], corner[v], corner[depth_axis]});
    const Outline<SlabCorner> *right = &slabs[0];
    const CoordinateRange across_slabs = range_of(*right, &SlabCorner::u);
    const int last_slab = across_slabs.last();
    MortonAxis u_code(u, across_slabs.first());
    for (int slab = across_slabs.first(); slab <= last_slab; ++slab, u_code.step()) {
        if (slab < last_slab) {
            Outline<SlabCorner> &above = right == &slabs[0] ? slabs[1] : slabs[0];
            cut_slab(*right, slab + 1, columns[0], above);
            right = &above;
        } else {
            columns[0].size = 0;
            for (std::size_t i = 0; i < right->size; ++i)
                columns[0].add({right->corners[i].v, right->corners[i].w});
        }
        const Outline<ColumnCorner> *upper = &columns[0];
        const CoordinateRange across_columns = range_of(*upper, &ColumnCorner::v);
        const int last_column = across_columns.last();
        MortonAxis v_code(v, across_columns.first());
        for (int column = across_columns.first(); column <= last_column; ++column, v_code.step()) {
            CoordinateRange layers;
            if (column < last_column) {
                Outline<ColumnCorner> &above = upper == &columns[0] ? columns[1] : columns[0];
                layers = cut_column(*upper, column + 1, above);
                upper = &above;
            } else {
                layers = range_of(*upper, &ColumnCorner::w);
            }
            const int last_layer = layers.last();
            MortonAxis w_code(depth_axis, layers.first());
            for (int layer = layers.first(); layer <= last_layer; ++layer, w_code.step())
                visit(u_code.code() | v_code.code() | w_code.code());
        }
    }
}

} // namespace pbm::build
