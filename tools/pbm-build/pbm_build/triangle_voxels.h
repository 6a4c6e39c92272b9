// All voxels that a triangle passes through, and the point of a triangle that is nearest to a voxel's centre.
// Based on: Sutherland, Hodgman. Reentrant polygon clipping. 1974
// Based on: Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (closest point on a triangle)
#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace pbm::build {

// A convex polygon: a triangle after up to four cuts has at most seven corners. Rounding may bend a sliver into one
// with a few more; what does not fit is dropped, it lies on the others.
struct Polygon {
    std::array<glm::dvec3, 10> corners;
    std::size_t size = 0;

    void add(const glm::dvec3 &p) {
        if (size < corners.size())
            corners[size++] = p;
    }
};

// Cuts at p[axis] = at: `below` gets what lies below (its border included), `polygon` keeps what lies above.
inline void cut(Polygon &polygon, int axis, double at, Polygon &below) {
    Polygon above;
    below.size = 0;
    for (std::size_t i = 0; i < polygon.size; ++i) {
        const glm::dvec3 &p = polygon.corners[i], &q = polygon.corners[i + 1 == polygon.size ? 0 : i + 1];
        if (p[axis] <= at)
            below.add(p);
        if (p[axis] >= at)
            above.add(p);
        if ((p[axis] < at && q[axis] > at) || (p[axis] > at && q[axis] < at)) {
            glm::dvec3 crossing = p + (at - p[axis]) / (q[axis] - p[axis]) * (q - p);
            crossing[axis] = at;
            below.add(crossing);
            above.add(crossing);
        }
    }
    polygon = above;
}

// Voxels [first, last] along one axis that a polygon overlaps: one that it only touches from outside does not count,
// so that a face at a voxel boundary makes one layer; but there is always one.
struct VoxelRange {
    int first, last;
};
inline VoxelRange overlap(const Polygon &polygon, int axis) {
    double low = polygon.corners[0][axis], high = low;
    for (std::size_t i = 1; i < polygon.size; ++i) {
        low = std::min(low, polygon.corners[i][axis]);
        high = std::max(high, polygon.corners[i][axis]);
    }
    const int first = static_cast<int>(std::floor(low));
    return {first, std::max(first, static_cast<int>(std::ceil(high)) - 1)};
}

// Calls visit(voxel) for every voxel whose inside the triangle enters; every point of the triangle lies in one of them
// or on its border. `corners` in voxel units; `depth_axis` is the axis closest to the triangle's normal: the two others
// span the columns that the triangle is cut into, and each piece is short along it.
template <class Visit> void visit_voxels(const std::array<glm::dvec3, 3> &corners, int depth_axis, Visit &&visit) {
    const int u = (depth_axis + 1) % 3, v = (depth_axis + 2) % 3;
    Polygon right{{corners[0], corners[1], corners[2]}, 3};
    const VoxelRange slabs = overlap(right, u);
    glm::ivec3 voxel;
    Polygon slab, column;
    for (voxel[u] = slabs.first; voxel[u] <= slabs.last; ++voxel[u]) {
        if (voxel[u] < slabs.last)
            cut(right, u, voxel[u] + 1, slab);
        else
            slab = right;
        const VoxelRange columns = overlap(slab, v);
        for (voxel[v] = columns.first; voxel[v] <= columns.last; ++voxel[v]) {
            if (voxel[v] < columns.last)
                cut(slab, v, voxel[v] + 1, column);
            else
                column = slab;
            const VoxelRange layers = overlap(column, depth_axis);
            for (voxel[depth_axis] = layers.first; voxel[depth_axis] <= layers.last; ++voxel[depth_axis])
                visit(voxel);
        }
    }
}

// Barycentric weights of the point of triangle abc that is nearest to p.
inline std::array<double, 3> nearest_on_triangle(const std::array<glm::dvec3, 3> &corners, const glm::dvec3 &p) {
    const auto dot = [](const glm::dvec3 &x, const glm::dvec3 &y) { return (x.x * y.x + x.y * y.y) + x.z * y.z; };
    const glm::dvec3 ab = corners[1] - corners[0], ac = corners[2] - corners[0];
    const glm::dvec3 ap = p - corners[0], bp = p - corners[1], cp = p - corners[2];
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                 d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0)
        return {1, 0, 0};
    if (d3 >= 0 && d4 <= d3)
        return {0, 1, 0};
    if (d6 >= 0 && d5 <= d6)
        return {0, 0, 1};
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3)
        return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6)
        return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && (d4 - d3) + (d5 - d6) > 0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0, 1 - t, t};
    }
    const double area = va + vb + vc;
    if (!(area > 0) || va < 0 || vb < 0 || vc < 0) // a sliver thinner than the arithmetic
        return {1.0 / 3, 1.0 / 3, 1.0 / 3};
    return {va / area, vb / area, vc / area};
}

} // namespace pbm::build
