#include "pbm_build/normals/outside_view.h"

#include "system/threads/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
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

// Depth maps along a view and against it, of the ball around `centre`.
struct Projection {
    glm::dvec3 centre;
    double radius, cell; // lattice steps
    std::size_t edge;    // cells of a row and of a column
    View view;
};

inline constexpr double kDepthSteps = 0x1p31; // of the ball's diameter
inline constexpr std::size_t kMaxDoubles = 8; // of a vector

// The places of points in a depth map. [points], and spare elements in which vectors may end
struct MapPlaces {
    explicit MapPlaces(std::size_t points) : cells(points + kMaxDoubles), depths(points + kMaxDoubles) {}
    std::vector<std::int32_t> cells, depths;
};
using BothPlaces = std::array<MapPlaces, 2>; // along the view, against it

} // namespace pbm::build
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Projects the points begin..end - 1. `end` is that of all points, or a multiple of kMaxDoubles behind `begin`. The
// opposite view has the same `up`, and the opposite `right`.
void project(const Projection &projection, const std::vector<LatticePoint> &points, std::size_t begin, std::size_t end,
             BothPlaces &places) {
    const hn::CappedTag<double, kMaxDoubles> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    const auto set = [&](double value) { return hn::Set(d, value); };
    const auto radius = set(projection.radius), zero = set(0);
    const auto last = set(static_cast<double>(projection.edge - 1));
    const auto place = [&](std::size_t i, auto x, auto y, auto z) {
        const auto dx = hn::Sub(hn::PromoteTo(d, x), set(projection.centre.x)),
                   dy = hn::Sub(hn::PromoteTo(d, y), set(projection.centre.y)),
                   dz = hn::Sub(hn::PromoteTo(d, z), set(projection.centre.z));
        const auto along = [&](const glm::dvec3 &axis) {
            return hn::Add(hn::Add(hn::Mul(dx, set(axis.x)), hn::Mul(dy, set(axis.y))), hn::Mul(dz, set(axis.z)));
        };
        const auto line = [&](auto from_edge) {
            return hn::DemoteTo(di, hn::Min(hn::Max(hn::Div(from_edge, set(projection.cell)), zero), last));
        };
        const auto right = along(projection.view.right), forward = along(projection.view.forward);
        const auto row = line(hn::Add(along(projection.view.up), radius));
        const auto store = [&](MapPlaces &to, auto across, auto ahead) {
            const auto edge = hn::Set(di, static_cast<std::int32_t>(projection.edge));
            hn::StoreU(hn::Add(hn::Mul(line(across), edge), row), di, &to.cells[i]);
            const auto depth = hn::Min(hn::Max(hn::Div(ahead, set(2 * projection.radius)), zero), set(1));
            hn::StoreU(hn::DemoteTo(di, hn::Mul(depth, set(kDepthSteps))), di, &to.depths[i]);
        };
        store(places[0], hn::Add(right, radius), hn::Add(forward, radius));
        store(places[1], hn::Sub(radius, right), hn::Sub(radius, forward));
    };
    std::size_t i = begin;
    for (; i + hn::Lanes(d) <= end; i += hn::Lanes(d)) {
        auto x = hn::Zero(di), y = x, z = x;
        hn::LoadInterleaved3(di, &points[i].x, x, y, z);
        place(i, x, y, z);
    }
    for (; i < end; ++i)
        place(i, hn::Set(di, points[i].x), hn::Set(di, points[i].y), hn::Set(di, points[i].z));
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(project);

namespace {

constexpr std::size_t kBlock = 16384;
constexpr double kCell = 3;        // edge of a depth map's cell in spacings: wide enough to leave no gaps
constexpr double kMaxCells = 1024; // along an edge of a depth map

glm::dvec3 unit(const glm::dvec3 &v) { return v / glm::length(v); }

// Along the axes, the diagonals of faces, and the diagonals of a cube: one of each two opposite directions.
std::vector<View> half_of_all_views() {
    std::vector<View> views;
    for (int i = 0; i < 13; ++i) {
        const int x = i / 9 - 1, y = i / 3 % 3 - 1, z = i % 3 - 1;
        const glm::dvec3 forward = unit(glm::dvec3(x, y, z));
        const glm::dvec3 right = unit(glm::cross(forward, x == 0 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
        views.push_back({forward, right, glm::cross(right, forward)});
    }
    return views;
}

// Depth map along one direction: the minimum depth in each cell.
class DepthMap {
  public:
    explicit DepthMap(const Projection &projection)
        : tolerance_(static_cast<std::int32_t>(
              std::min(projection.cell / (4 * projection.radius) * kDepthSteps, kDepthSteps - 1))),
          nearest_(projection.edge * projection.edge) {}

    void clear() {
        for (std::atomic<std::int32_t> &depth : nearest_)
            depth.store(std::numeric_limits<std::int32_t>::max(), std::memory_order_relaxed);
    }
    void add(const MapPlaces &places, std::size_t point) {
        std::atomic<std::int32_t> &nearest = nearest_[static_cast<std::size_t>(places.cells[point])];
        const std::int32_t depth = places.depths[point];
        std::int32_t least = nearest.load(std::memory_order_relaxed);
        while (depth < least && !nearest.compare_exchange_weak(least, depth, std::memory_order_relaxed)) {
        }
    }
    bool shows(const MapPlaces &places, std::size_t point) const {
        const auto cell = static_cast<std::size_t>(places.cells[point]);
        return places.depths[point] - nearest_[cell].load(std::memory_order_relaxed) <= tolerance_;
    }

  private:
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
    const double cell = std::max(kCell * spacing, 2 * radius / kMaxCells);
    Projection projection{glm::dvec3(lowest) + half, radius, cell, static_cast<std::size_t>(2 * radius / cell) + 1, {}};
    std::array<DepthMap, 2> maps{DepthMap(projection), DepthMap(projection)};
    BothPlaces places{MapPlaces(points.size()), MapPlaces(points.size())};
    for (const View &view : half_of_all_views()) {
        projection.view = view;
        for (DepthMap &map : maps)
            map.clear();
        parallel_blocks(points.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
            HWY_DYNAMIC_DISPATCH(project)(projection, points, begin, end, places);
            for (const std::size_t way : {std::size_t{0}, std::size_t{1}})
                for (std::size_t i = begin; i < end; ++i)
                    maps[way].add(places[way], i);
        });
        const ShortNormal sight = to_short_normal(view.forward);
        parallel_for(points.size(), kBlock, threads, [&](std::size_t i) {
            const ShortNormal &n = normals[i]; // the product of two unit vectors fits 32 bits
            const std::int32_t product = sight[0] * n[0] + sight[1] * n[1] + sight[2] * n[2];
            const std::int32_t ahead = maps[0].shows(places[0], i) ? product >> 15 : 0,
                               behind = maps[1].shows(places[1], i) ? -product >> 15 : 0;
            seen.towards[i] -= ahead + behind;
            seen.seen[i] += std::abs(ahead) + std::abs(behind);
        });
    }
    return seen;
}

bool looks_like_body(const OutsideView &view) {
    constexpr std::int32_t kGlimpse = 0x2666; // 0.3 of a view
    std::int64_t from_one_side = 0, from_both = 0, hidden = 0;
    for (std::size_t i = 0; i < view.seen.size(); ++i) {
        from_one_side += std::abs(view.towards[i]);
        from_both += view.seen[i];
        hidden += view.seen[i] < kGlimpse ? 1 : 0;
    }
    return 10 * from_one_side > 7 * from_both && 5 * hidden < static_cast<std::int64_t>(view.seen.size());
}

} // namespace pbm::build
#endif // HWY_ONCE
