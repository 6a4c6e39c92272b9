#include "pbm_build/normals/outside_view.h"

#include "system/threads/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <limits>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 16384;
constexpr double kCell = 3;        // edge of a depth map's cell in spacings: wide enough to leave no gaps
constexpr double kMaxCells = 1024; // along an edge of a depth map

struct View {
    glm::dvec3 forward, right, up; // unit vectors; `forward` is the direction of sight
};

glm::dvec3 unit(const glm::dvec3 &v) { return v / glm::length(v); }

// Along the axes, the diagonals of faces, and the diagonals of a cube.
std::vector<View> all_views() {
    std::vector<View> views;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (x != 0 || y != 0 || z != 0) {
                    const glm::dvec3 forward = unit(glm::dvec3(x, y, z));
                    const glm::dvec3 right =
                        unit(glm::cross(forward, x == 0 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
                    views.push_back({forward, right, glm::cross(right, forward)});
                }
    return views;
}

// Depth map along one direction: the minimum depth in each cell.
class DepthMap {
  public:
    DepthMap(const glm::dvec3 &centre, double radius, double cell)
        : centre_(centre), radius_(radius), cell_(cell), edge_(static_cast<std::size_t>(2 * radius / cell) + 1),
          tolerance_(steps(cell / 2)), nearest_(edge_ * edge_) {}

    void clear(const View &view) {
        view_ = view;
        for (std::atomic<std::uint32_t> &depth : nearest_)
            depth.store(std::numeric_limits<std::uint32_t>::max(), std::memory_order_relaxed);
    }
    void add(const LatticePoint &p) {
        const auto [cell, depth] = place(p);
        std::atomic<std::uint32_t> &nearest = nearest_[cell];
        std::uint32_t least = nearest.load(std::memory_order_relaxed);
        while (depth < least && !nearest.compare_exchange_weak(least, depth, std::memory_order_relaxed)) {
        }
    }
    bool sees(const LatticePoint &p) const {
        const auto [cell, depth] = place(p);
        return depth - nearest_[cell].load(std::memory_order_relaxed) <= tolerance_;
    }

  private:
    struct Place {
        std::size_t cell;
        std::uint32_t depth;
    };
    Place place(const LatticePoint &p) const {
        const glm::dvec3 d = glm::dvec3(p) - centre_;
        const auto column = [&](const glm::dvec3 &axis) {
            const double cells = (glm::dot(d, axis) + radius_) / cell_;
            return static_cast<std::size_t>(std::clamp(cells, 0.0, static_cast<double>(edge_ - 1)));
        };
        return {column(view_.right) * edge_ + column(view_.up), steps(glm::dot(d, view_.forward) + radius_)};
    }
    std::uint32_t steps(double depth) const { // 2^-31 of the diameter
        return static_cast<std::uint32_t>(std::clamp(depth / (2 * radius_), 0.0, 1.0) * 0x1p31);
    }

    glm::dvec3 centre_;
    double radius_, cell_;
    std::size_t edge_;
    std::uint32_t tolerance_; // behind the nearest point of its cell
    View view_{};
    std::vector<std::atomic<std::uint32_t>> nearest_; // [edge][edge]
};

} // namespace

OutsideView view_from_outside(const std::vector<LatticePoint> &points, const std::vector<ShortNormal> &normals,
                              double spacing, int threads) {
    OutsideView seen{std::vector<std::int32_t>(points.size()), std::vector<std::int32_t>(points.size())};
    if (points.empty())
        return seen;
    LatticePoint lowest = points.front(), highest = points.front();
    for (const LatticePoint &p : points) {
        lowest = glm::min(lowest, p);
        highest = glm::max(highest, p);
    }
    const glm::dvec3 half = (glm::dvec3(highest) - glm::dvec3(lowest)) * 0.5;
    const double radius = std::max(1.0, glm::length(half));
    DepthMap map(glm::dvec3(lowest) + half, radius, std::max(kCell * spacing, 2 * radius / kMaxCells));
    for (const View &view : all_views()) {
        map.clear(view);
        parallel_for(points.size(), kBlock, threads, [&](std::size_t i) { map.add(points[i]); });
        const ShortNormal sight = to_short_normal(view.forward);
        parallel_for(points.size(), kBlock, threads, [&](std::size_t i) {
            if (!map.sees(points[i]))
                return;
            const auto away = static_cast<std::int32_t>(dot(sight, normals[i]) >> 15);
            seen.towards[i] -= away;
            seen.seen[i] += std::abs(away);
        });
    }
    return seen;
}

} // namespace pbm::build
