// The Voronoi cell of a point among its neighbours in its tangent plane: what its splat has to cover.
// Based on: Sutherland, Hodgman. Reentrant Polygon Clipping. 1974 (one cut per neighbour)
#pragma once

#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace pbm::build {

// A convex polygon around the origin: an octagon of circumradius `radius`, less what is nearer to another point.
class TangentCell {
  public:
    explicit TangentCell(double radius) : count_(8), farthest_(radius * radius) {
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
            corners_[i] = {radius * corners[i], false};
    }

    // Takes away what is nearer to `other`, not the origin. At most kMostCuts times.
    static constexpr std::size_t kMostCuts = 24;
    void cut(const glm::dvec2 &other) {
        const double limit = (other.x * other.x + other.y * other.y) / 2;
        if (limit >= 2 * farthest_) // half way to `other` lies outside
            return;
        const auto beyond = [&](const Corner &c) { return c.at.x * other.x + c.at.y * other.y - limit; };
        std::array<Corner, kMostCorners> kept;
        std::size_t kept_count = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const Corner &from = corners_[i], &to = corners_[(i + 1) % count_];
            const double a = beyond(from), b = beyond(to);
            if (a <= 0)
                kept[kept_count++] = from;
            if ((a <= 0) == (b <= 0))
                continue;
            const glm::dvec2 at = from.at + (to.at - from.at) * (a / (a - b));
            kept[kept_count++] = {at, a <= 0 ? true : from.next_edge_is_cut};
        }
        assert(kept_count <= kMostCorners);
        std::copy_n(kept.begin(), kept_count, corners_.begin());
        count_ = kept_count;
        farthest_ = 0;
        for (std::size_t i = 0; i < count_; ++i)
            farthest_ = std::max(farthest_, squared(corners_[i].at));
    }

    struct Reach {
        double closed = 0; // distance of the farthest corner between two neighbours
        bool open = false; // a side of the octagon is left: there is no neighbour that way
    };
    Reach reach() const {
        Reach reach;
        double farthest = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            const bool closed = corners_[i].next_edge_is_cut && corners_[(i + count_ - 1) % count_].next_edge_is_cut;
            if (closed)
                farthest = std::max(farthest, squared(corners_[i].at));
            reach.open = reach.open || !closed;
        }
        reach.closed = std::sqrt(farthest);
        return reach;
    }

  private:
    struct Corner { // without defaults: a cut would fill thirty of them before it starts
        glm::dvec2 at;
        bool next_edge_is_cut; // the edge to the next corner lies between two points
    };
    static double squared(const glm::dvec2 &v) { return v.x * v.x + v.y * v.y; }
    static constexpr std::size_t kMostCorners = 8 + kMostCuts;

    std::array<Corner, kMostCorners> corners_;
    std::size_t count_;
    double farthest_; // squared distance of the farthest corner
};

} // namespace pbm::build
