// The Voronoi cell of a point in its tangent plane: the area that its splat must cover.
// Based on: Sutherland, Hodgman. Reentrant Polygon Clipping. 1974 (one cut per neighbour)
#pragma once

#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace pbm::build {

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

    // Clips the polygon at the bisector between the origin and `other`. At most kMaxCuts calls.
    static constexpr std::size_t kMaxCuts = 24;
    void cut(const glm::dvec2 &other) {
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
            kept[kept_count] = {from.at + (to.at - from.at) * (a / (a - b)), inside | from.next_edge_is_cut};
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
            const bool closed =
                (corners[i].next_edge_is_cut & corners[i > 0 ? i - 1 : count_ - 1].next_edge_is_cut) != 0;
            if (closed)
                farthest = std::max(farthest, squared(corners[i].at));
            reach.open = reach.open || !closed;
        }
        reach.closed = std::sqrt(farthest);
        return reach;
    }

  private:
    struct Corner { // no default values: initialising them would take as long as a cut
        glm::dvec2 at;
        int next_edge_is_cut; // 1: the edge to the next corner lies between two points
    };
    static double squared(const glm::dvec2 &v) { return v.x * v.x + v.y * v.y; }
    static constexpr std::size_t kMaxCorners = 8 + kMaxCuts;
    using Corners = std::array<Corner, kMaxCorners + 2>; // the first corner repeated, and one spare

    std::array<Corners, 2> corners_; // the current polygon, and the target of the next cut
    std::size_t now_ = 0, count_;
};

} // namespace pbm::build
