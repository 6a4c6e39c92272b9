#include "pbm_build/normals/outside_view.h"

#include "system/threads/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <limits>
#include <span>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/normals/outside_view.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#ifndef PBM_OUTSIDE_VIEW_TYPES // once for all targets
#define PBM_OUTSIDE_VIEW_TYPES
namespace pbm::build {

struct View {
    glm::dvec3 forward, right, up; // unit vectors; `forward` is the direction of sight
};

// A depth map along a view, of the ball around `centre`.
struct Projection {
    glm::dvec3 centre;
    double radius, cell; // lattice steps
    std::size_t edge;    // cells of a row and of a column
    View view;
};

inline constexpr double kDepthSteps = 0x1p31; // of the ball's diameter

// The places of some points in a depth map.
struct MapPlaces {
    static constexpr std::size_t kPoints = 512, kSpare = 8; // vectors may end in spare elements
    alignas(64) std::array<std::int32_t, kPoints + kSpare> cells, depths;
};

} // namespace pbm::build
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Projects at most MapPlaces::kPoints points.
void project(const Projection &projection, std::span<const LatticePoint> points, MapPlaces &places) {
    const hn::CappedTag<double, MapPlaces::kSpare> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    const auto set = [&](double value) { return hn::Set(d, value); };
    const auto radius = set(projection.radius), zero = set(0);
    const auto last = set(static_cast<double>(projection.edge - 1));
    const auto place = [&](std::size_t i, auto x, auto y, auto z) {
        const auto dx = hn::Sub(hn::PromoteTo(d, x), set(projection.centre.x)),
                   dy = hn::Sub(hn::PromoteTo(d, y), set(projection.centre.y)),
                   dz = hn::Sub(hn::PromoteTo(d, z), set(projection.centre.z));
        const auto along = [&](const glm::dvec3 &axis) {
            return hn::Add(
                hn::Add(hn::Add(hn::Mul(dx, set(axis.x)), hn::Mul(dy, set(axis.y))), hn::Mul(dz, set(axis.z))), radius);
        };
        const auto column = [&](const glm::dvec3 &axis) {
            return hn::DemoteTo(di, hn::Min(hn::Max(hn::Div(along(axis), set(projection.cell)), zero), last));
        };
        const auto depth = hn::Div(along(projection.view.forward), set(2 * projection.radius));
        hn::StoreU(
            hn::Add(hn::Mul(column(projection.view.right), hn::Set(di, static_cast<std::int32_t>(projection.edge))),
                    column(projection.view.up)),
            di, &places.cells[i]);
        hn::StoreU(hn::DemoteTo(di, hn::Mul(hn::Min(hn::Max(depth, zero), set(1)), set(kDepthSteps))), di,
                   &places.depths[i]);
    };
    std::size_t i = 0;
    for (; i + hn::Lanes(d) <= points.size(); i += hn::Lanes(d)) {
        auto x = hn::Zero(di), y = x, z = x;
        hn::LoadInterleaved3(di, &points[i].x, x, y, z);
        place(i, x, y, z);
    }
    for (; i < points.size(); ++i)
        place(i, hn::Set(di, points[i].x), hn::Set(di, points[i].y), hn::Set(di, points[i].z));
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(project);

namespace {

constexpr std::size_t kBlock = 32 * MapPlaces::kPoints;
constexpr double kCell = 3;        // edge of a depth map's cell in spacings: wide enough to leave no gaps
constexpr double kMaxCells = 1024; // along an edge of a depth map

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
        : projection_{centre, radius, cell, static_cast<std::size_t>(2 * radius / cell) + 1, {}},
          tolerance_(static_cast<std::int32_t>(std::min(cell / (4 * radius) * kDepthSteps, kDepthSteps - 1))),
          nearest_(projection_.edge * projection_.edge) {}

    void clear(const View &view) {
        projection_.view = view;
        for (std::atomic<std::int32_t> &depth : nearest_)
            depth.store(std::numeric_limits<std::int32_t>::max(), std::memory_order_relaxed);
    }
    void add(std::span<const LatticePoint> points) {
        for_places(points, [&](std::size_t, std::size_t cell, std::int32_t depth) {
            std::atomic<std::int32_t> &nearest = nearest_[cell];
            std::int32_t least = nearest.load(std::memory_order_relaxed);
            while (depth < least && !nearest.compare_exchange_weak(least, depth, std::memory_order_relaxed)) {
            }
        });
    }
    // Calls `work(index, visible)` for each point.
    template <class Work> void look_at(std::span<const LatticePoint> points, const Work &work) const {
        for_places(points, [&](std::size_t i, std::size_t cell, std::int32_t depth) {
            work(i, depth - nearest_[cell].load(std::memory_order_relaxed) <= tolerance_);
        });
    }

  private:
    template <class Work> void for_places(std::span<const LatticePoint> points, const Work &work) const {
        MapPlaces places;
        for (std::size_t first = 0; first < points.size(); first += MapPlaces::kPoints) {
            const auto some = points.subspan(first, std::min(MapPlaces::kPoints, points.size() - first));
            HWY_DYNAMIC_DISPATCH(project)(projection_, some, places);
            for (std::size_t i = 0; i < some.size(); ++i)
                work(first + i, static_cast<std::size_t>(places.cells[i]), places.depths[i]);
        }
    }

    Projection projection_;
    std::int32_t tolerance_;                         // behind the nearest point of its cell, in kDepthSteps
    std::vector<std::atomic<std::int32_t>> nearest_; // [edge][edge]
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
        const auto some = [&](std::size_t begin, std::size_t end) {
            return std::span(points).subspan(begin, end - begin);
        };
        parallel_blocks(points.size(), kBlock, threads,
                        [&](std::size_t begin, std::size_t end) { map.add(some(begin, end)); });
        const ShortNormal sight = to_short_normal(view.forward);
        parallel_blocks(points.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
            map.look_at(some(begin, end), [&](std::size_t i, bool visible) {
                const ShortNormal &n = normals[begin + i]; // the product of two unit vectors fits 32 bits
                const std::int32_t cosine = (sight[0] * n[0] + sight[1] * n[1] + sight[2] * n[2]) >> 15;
                const std::int32_t away = visible ? cosine : 0;
                seen.towards[begin + i] -= away;
                seen.seen[begin + i] += std::abs(away);
            });
        });
    }
    return seen;
}

} // namespace pbm::build
#endif // HWY_ONCE
