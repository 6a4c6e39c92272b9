// The reflex corners of an outline, for the question whether a triangle contains one of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace pbm::build {

struct PlanePoint {
    double x = 0, y = 0;
    bool operator==(const PlanePoint &) const = default;
};

// Twice the area of a triangle: positive where a, b, c turn left. Monotonic in each coordinate of c, rounding included.
inline double turn_of(const PlanePoint &a, const PlanePoint &b, const PlanePoint &c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// A tree of boxes over the outline: neighbours along it are neighbours in the plane.
class ReflexCorners {
  public:
    // `points` [corners] in the order of the outline; none is reflex yet.
    void reset(const std::vector<PlanePoint> &points) {
        points_ = &points;
        leaves_ = 1;
        while (leaves_ < points.size())
            leaves_ *= 2;
        counts_.assign(2 * leaves_, 0);
        boxes_.assign(2 * leaves_, Box{});
        for (std::size_t i = 0; i < points.size(); ++i)
            boxes_[leaves_ + i] = {points[i].x, points[i].x, points[i].y, points[i].y};
        for (std::size_t node = leaves_; node-- > 1;) {
            const Box &a = boxes_[2 * node], &b = boxes_[2 * node + 1];
            boxes_[node] = {std::min(a.x0, b.x0), std::max(a.x1, b.x1), std::min(a.y0, b.y0), std::max(a.y1, b.y1)};
        }
    }

    void set(std::uint32_t corner, bool reflex) {
        std::size_t node = leaves_ + corner;
        if ((counts_[node] != 0) == reflex)
            return;
        for (; node > 0; node /= 2)
            counts_[node] += reflex ? 1 : -1;
    }

    // A reflex corner in the triangle, borders included, that is at none of its corners. Subtracts the visited boxes
    // from `budget`; finds none where that is spent.
    std::optional<std::uint32_t> find_in(const std::array<PlanePoint, 3> &triangle, std::size_t &budget) const {
        const auto [a, b, c] = triangle;
        const Query query{triangle,
                          {std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}),
                           std::max({a.y, b.y, c.y})}};
        return find_below(1, query, budget);
    }

  private:
    struct Box {
        static constexpr double kFar = std::numeric_limits<double>::infinity();
        double x0 = kFar, x1 = -kFar, y0 = kFar, y1 = -kFar; // empty
    };

    // Whether all of the box lies to the right of the edge from a to b.
    static bool is_right_of(const Box &box, const PlanePoint &a, const PlanePoint &b) {
        return turn_of(a, b, {b.y > a.y ? box.x0 : box.x1, b.x > a.x ? box.y1 : box.y0}) < 0;
    }

    // A triangle.
    struct Query {
        std::array<PlanePoint, 3> corners;
        Box box;

        bool misses(const Box &other) const {
            return other.x0 > box.x1 || other.x1 < box.x0 || other.y0 > box.y1 || other.y1 < box.y0 ||
                   is_right_of(other, corners[0], corners[1]) || is_right_of(other, corners[1], corners[2]) ||
                   is_right_of(other, corners[2], corners[0]);
        }
    };

    std::optional<std::uint32_t> find_below(std::size_t node, const Query &query, std::size_t &budget) const {
        if (counts_[node] == 0 || budget == 0)
            return std::nullopt;
        --budget;
        if (query.misses(boxes_[node]))
            return std::nullopt;
        if (node >= leaves_) {
            const std::size_t corner = node - leaves_;
            const auto &of_triangle = query.corners;
            const bool is_one =
                std::find(of_triangle.begin(), of_triangle.end(), (*points_)[corner]) != of_triangle.end();
            return is_one ? std::nullopt : std::optional(static_cast<std::uint32_t>(corner));
        }
        const auto left = find_below(2 * node, query, budget);
        return left ? left : find_below(2 * node + 1, query, budget);
    }

    const std::vector<PlanePoint> *points_ = nullptr;
    std::size_t leaves_ = 1;           // a power of two
    std::vector<std::int32_t> counts_; // [nodes] reflex corners below; the children of node i are 2 i and 2 i + 1
    std::vector<Box> boxes_;
};

} // namespace pbm::build
