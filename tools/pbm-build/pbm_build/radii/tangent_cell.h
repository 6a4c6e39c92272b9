// The Voronoi cell of a point in its tangent plane: the area that its splat must cover.
// Based on: Sutherland, Hodgman. Reentrant Polygon Clipping. 1974 (one cut per neighbour)
#pragma once

#include "pbm_format/model/normal.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace pbm::build {

// Unit vector of a normal index; the bit of two-sided points does not matter.
inline glm::dvec3 direction_of(std::uint16_t normal) {
    const UnitVector &n = normal_table()[normal & kNormalIndexMask];
    return {n[0], n[1], n[2]};
}

// An orthonormal basis whose third axis is the unit vector `n`.
// Based on: Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin. Building an Orthonormal Basis, Revisited. 2017
struct TangentPlane {
    explicit TangentPlane(const glm::dvec3 &n) : normal(n) {
        const double sign = n.z < 0 ? -1 : 1, a = -1 / (sign + n.z), b = n.x * n.y * a;
        right = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
        up = {b, sign + n.y * n.y * a, -n.y};
    }
    glm::dvec2 flat(const glm::dvec3 &offset) const { return {glm::dot(offset, right), glm::dot(offset, up)}; }
    double height(const glm::dvec3 &offset) const { return glm::dot(offset, normal); }

    glm::dvec3 normal, right, up;
};

// Whether two points belong to one sheet of the surface: normals within 60 degrees, and a slope below 45 degrees or a
// step of at most a voxel. `squared`: squared distance in the tangent plane; lengths in voxels.
inline bool is_same_sheet(double cosine, double height, double squared) {
    return cosine > 0.5 && (std::fabs(height) <= 1 || height * height < squared);
}

// A convex polygon around the origin: an octagon of circumradius `radius`, clipped by the bisectors of its neighbours.
class TangentCell {
  public:
    explicit TangentCell(double radius) : count_(8) {
        constexpr double kDiagonal = 0.7071067811865476;
        const std::array<glm::dvec2, 8> corners{{{1, 0},
                                                 {kDiagonal, kDiagonal},
                                                 {0, 1},
                                                 {-kDiagonal, kDiagonal},
                                                 {-1, 0},
                                                 {-kDiagonal, -kDiagonal},
                                                 {0, -1},
                                                 {kDiagonal, -kDiagonal}}};
        for (std::size_t i = 0; i < count_; ++i)
            corners_[0][i] = {radius * corners[i], 0};
    }

    struct Corner { // no default values: initialising them would take as long as a cut
        glm::dvec2 at;
        int next_edge; // 0, or the label of the neighbour beyond the edge to the next corner
    };

    // Clips the polygon at the bisector between the origin and `other`. `label` is positive. At most kMaxCuts calls.
    static constexpr std::size_t kMaxCuts = 448;
    void cut(const glm::dvec2 &other, int label = 1) {
        const double limit = (other.x * other.x + other.y * other.y) / 2;
        Corners &corners = corners_[now_], &kept = corners_[1 - now_];
        std::array<double, kMaxCorners + 1> beyond; // scaled distance of each corner from the bisector
        int outside = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            beyond[i] = corners[i].at.x * other.x + corners[i].at.y * other.y - limit;
            outside |= beyond[i] > 0 ? 1 : 0;
        }
        if (outside == 0)
            return;
        // Branch-free: every corner and crossing is written, and the count advances only for those inside.
        beyond[count_] = beyond[0];
        corners[count_] = corners[0];
        std::size_t kept_count = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const Corner &from = corners[i], &to = corners[i + 1];
            const double a = beyond[i], b = beyond[i + 1];
            const int inside = a <= 0 ? 1 : 0, next_inside = b <= 0 ? 1 : 0;
            kept[kept_count] = from;
            kept_count += static_cast<std::size_t>(inside);
            kept[kept_count] = {from.at + (to.at - from.at) * (a / (a - b)),
                                (label & -inside) | (from.next_edge & (inside - 1))};
            kept_count += static_cast<std::size_t>(inside ^ next_inside);
        }
        assert(kept_count <= kMaxCorners);
        count_ = kept_count;
        now_ = 1 - now_;
    }

    struct Reach {
        double closed = 0; // distance of the farthest corner between two neighbours
        bool open = false; // a side of the octagon remains: no neighbour lies in that direction
    };
    Reach reach() const {
        Reach reach;
        double farthest = 0;
        const Corners &corners = corners_[now_];
        for (std::size_t i = 0; i < count_; ++i) {
            const bool closed = std::min(corners[i].next_edge, corners[i > 0 ? i - 1 : count_ - 1].next_edge) > 0;
            if (closed)
                farthest = std::max(farthest, squared(corners[i].at));
            reach.open = reach.open || !closed;
        }
        reach.closed = std::sqrt(farthest);
        return reach;
    }

    std::span<const Corner> corners() const { return std::span(corners_[now_]).first(count_); }

  private:
    static double squared(const glm::dvec2 &v) { return v.x * v.x + v.y * v.y; }
    static constexpr std::size_t kMaxCorners = 8 + kMaxCuts;
    using Corners = std::array<Corner, kMaxCorners + 2>; // the first corner repeated, and one spare

    std::array<Corners, 2> corners_; // the current polygon, and the target of the next cut
    std::size_t now_ = 0, count_;
};

} // namespace pbm::build
