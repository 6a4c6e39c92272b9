#include "pbm_build/grid/up_axis.h"

#include "pbm_scan/text/printable.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <vector>

namespace pbm::build {
namespace {

constexpr std::size_t kBins = 4096;      // of an axis, for the box
constexpr std::uint64_t kTrimmed = 1000; // a part of this many is beyond each side of the box
constexpr int kCubes = 64;
constexpr int kMaxSteps = 16; // samples along the edge of a triangle
constexpr std::size_t kBlock = 65536;
constexpr double kMinShare = 0.3, kMaxRival = 2.0 / 3, kUpsideDown = 0.5;

using Place = std::array<int, 3>;

// Calls `work` with the corners of each triangle, and with each point three times.
template <class Work> void for_each_triangle(const Surface &surface, int threads, const Work &work) {
    const auto &positions = surface.positions;
    parallel_blocks(surface.triangles.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        work([&](const auto &with) {
            for (std::size_t i = begin; i < end; ++i) {
                const glm::uvec3 &t = surface.triangles[i];
                with(positions[t.x], positions[t.y], positions[t.z]);
            }
        });
    });
    const std::size_t first = surface.first_point();
    parallel_blocks(positions.size() - first, kBlock, threads, [&](std::size_t begin, std::size_t end) {
        work([&](const auto &with) {
            for (std::size_t i = first + begin; i < first + end; ++i)
                with(positions[i], positions[i], positions[i]);
        });
    });
}

// The box without the outermost positions.
Bounds trimmed(const Surface &surface, const Bounds &bounds, int threads) {
    using Histogram = std::array<std::array<std::uint64_t, kBins>, 3>;
    const auto counts = std::make_unique<Histogram>();
    std::mutex mutex; // guards counts
    const glm::dvec3 size = bounds.highest - bounds.lowest;
    const auto bin = [&](const glm::dvec3 &p, int axis) {
        const double at = size[axis] > 0 ? (p[axis] - bounds.lowest[axis]) / size[axis] : 0;
        return static_cast<std::size_t>(std::clamp(at * kBins, 0.0, kBins - 1.0));
    };
    for_each_triangle(surface, threads, [&](const auto &for_each) {
        const auto some = std::make_unique<Histogram>();
        for_each([&](const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c) {
            for (int axis = 0; axis < 3; ++axis)
                for (const glm::dvec3 *p : {&a, &b, &c})
                    ++(*some)[static_cast<std::size_t>(axis)][bin(*p, axis)];
        });
        const std::lock_guard lock(mutex);
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < kBins; ++i)
                (*counts)[axis][i] += (*some)[axis][i];
    });
    const std::uint64_t beyond = 3 * (surface.triangles.size() + surface.point_count()) / kTrimmed;
    Bounds box = bounds;
    for (int axis = 0; axis < 3; ++axis) {
        const auto &count = (*counts)[static_cast<std::size_t>(axis)];
        std::size_t low = 0, high = kBins;
        for (std::uint64_t sum = count[low]; sum <= beyond && low + 1 < kBins; sum += count[low])
            ++low;
        for (std::uint64_t sum = count[high - 1]; sum <= beyond && high > low + 1; sum += count[high - 1])
            --high;
        box.lowest[axis] = bounds.lowest[axis] + size[axis] * static_cast<double>(low) / kBins;
        box.highest[axis] = bounds.lowest[axis] + size[axis] * static_cast<double>(high) / kBins;
    }
    return box;
}

// The occupied cubes of a box.
class Cubes {
  public:
    explicit Cubes(const Bounds &box) : box_(box), edge_(box.extent() / kCubes), occupied_(kCubes * kCubes * kCubes) {
        for (int axis = 0; axis < 3; ++axis)
            size_[static_cast<std::size_t>(axis)] =
                std::clamp(static_cast<int>(std::ceil((box.highest[axis] - box.lowest[axis]) / edge_)), 1, kCubes);
    }

    // Marks the cubes of a triangle's corners, and of samples between them where they are far apart. Any thread.
    void mark(const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c) {
        const glm::dvec3 u = b - a, v = c - a;
        double longest = 0; // in cubes
        for (int axis = 0; axis < 3; ++axis)
            longest = std::max({longest, std::abs(u[axis]), std::abs(v[axis])});
        if (longest <= edge_) { // one step, without the divisions below
            mark(a);
            mark(a + v);
            mark(a + u);
            return;
        }
        const int steps = std::clamp(static_cast<int>(std::ceil(std::min(longest / edge_, 1e3))), 1, kMaxSteps);
        for (int i = 0; i <= steps; ++i)
            for (int j = 0; j <= steps - i; ++j)
                mark(a + (u * static_cast<double>(i) + v * static_cast<double>(j)) / static_cast<double>(steps));
    }

    Place size() const { return size_; }
    std::vector<Place> places() const {
        std::vector<Place> places;
        for (int z = 0; z < kCubes; ++z)
            for (int y = 0; y < kCubes; ++y)
                for (int x = 0; x < kCubes; ++x)
                    if (occupied_[index({x, y, z})] != 0)
                        places.push_back({x, y, z});
        return places;
    }

  private:
    static std::size_t index(const Place &p) {
        const int number = (p[2] * kCubes + p[1]) * kCubes + p[0];
        return static_cast<std::size_t>(number);
    }
    void mark(const glm::dvec3 &p) {
        Place place{};
        for (int axis = 0; axis < 3; ++axis) {
            if (!(p[axis] >= box_.lowest[axis] && p[axis] <= box_.highest[axis]))
                return;
            const auto to = static_cast<std::size_t>(axis);
            place[to] = std::min(static_cast<int>((p[axis] - box_.lowest[axis]) / edge_), size_[to] - 1);
        }
        occupied_[index(place)].store(1, std::memory_order_relaxed);
    }

    const Bounds box_;
    const double edge_;
    Place size_{};
    std::vector<std::atomic<std::uint8_t>> occupied_;
};

// The hull of the squares that some cubes cover on the plane across an axis, counter-clockwise.
class Outline {
  public:
    struct Corner {
        std::int64_t u, v;
        auto operator<=>(const Corner &) const = default;
    };

    Outline(const std::vector<Place> &places, std::size_t axis, int first, int last) {
        std::array<std::array<int, 2>, kCubes> rows{}; // the first square of a row, and the end of its last one
        rows.fill({kCubes, 0});
        for (const Place &p : places)
            if (p[axis] >= first && p[axis] <= last) {
                const int u = p[(axis + 1) % 3];
                auto &[begin, end] = rows[static_cast<std::size_t>(p[(axis + 2) % 3])];
                begin = std::min(begin, u);
                end = std::max(end, u + 1);
            }
        std::vector<Corner> corners;
        for (int v = 0; v < kCubes; ++v)
            if (const auto [begin, end] = rows[static_cast<std::size_t>(v)]; begin < end)
                corners.insert(corners.end(), {{begin, v}, {begin, v + 1}, {end, v}, {end, v + 1}});
        std::ranges::sort(corners);
        add_chain(corners);
        std::ranges::reverse(corners);
        add_chain(corners);
    }

    std::int64_t twice_area() const {
        std::int64_t sum = 0;
        for (std::size_t i = 0; i < hull_.size(); ++i)
            sum += turn({0, 0}, hull_[i], hull_[(i + 1) % hull_.size()]);
        return sum;
    }
    // Whether the point sum / count lies inside.
    bool holds(Corner sum, std::int64_t count) const {
        for (std::size_t i = 0; i < hull_.size(); ++i) {
            const Corner a = hull_[i], b = hull_[(i + 1) % hull_.size()];
            if ((b.u - a.u) * (sum.v - a.v * count) < (b.v - a.v) * (sum.u - a.u * count))
                return false;
        }
        return !hull_.empty();
    }

  private:
    static std::int64_t turn(Corner a, Corner b, Corner c) {
        return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
    }
    // One half of the hull of sorted corners, without its last corner.
    // Based on: Andrew. Another efficient algorithm for convex hulls in two dimensions. 1979
    void add_chain(const std::vector<Corner> &corners) {
        const std::size_t begin = hull_.size();
        for (const Corner &corner : corners) {
            while (hull_.size() >= begin + 2 && turn(hull_[hull_.size() - 2], hull_.back(), corner) <= 0)
                hull_.pop_back();
            hull_.push_back(corner);
        }
        if (!hull_.empty())
            hull_.pop_back();
    }

    std::vector<Corner> hull_;
};

// The share of the base of places first..last along an axis, 0 if the thing does not stand on it.
double base_share(const std::vector<Place> &places, std::size_t axis, int first, int last) {
    Outline::Corner centre{0, 0}; // twice the sum over the cubes
    for (const Place &p : places) {
        centre.u += 2 * p[(axis + 1) % 3] + 1;
        centre.v += 2 * p[(axis + 2) % 3] + 1;
    }
    const Outline base(places, axis, first, last), all(places, axis, 0, kCubes - 1);
    if (!base.holds(centre, 2 * static_cast<std::int64_t>(places.size())))
        return 0;
    return static_cast<double>(base.twice_area()) / static_cast<double>(all.twice_area());
}

bool is_terrain(const std::vector<Place> &places, const Place &size, std::size_t axis) {
    if (3 * size[axis] > std::min(size[(axis + 1) % 3], size[(axis + 2) % 3]))
        return false;
    std::vector<bool> columns(kCubes * kCubes);
    for (const Place &p : places) {
        const int column = p[(axis + 1) % 3] * kCubes + p[(axis + 2) % 3];
        columns[static_cast<std::size_t>(column)] = true;
    }
    const auto count = std::ranges::count(columns, true);
    return 10 * count >= 3 * Outline(places, axis, 0, kCubes - 1).twice_area() && // 0.6 of the area
           static_cast<std::int64_t>(places.size()) <= 2 * count;
}

} // namespace

FoundUp find_up_axis(const Surface &surface, const Bounds &bounds, int threads) {
    const Bounds box = trimmed(surface, bounds, threads);
    if (!(box.extent() > 0))
        return {};
    Cubes cubes(box);
    for_each_triangle(surface, threads, [&](const auto &for_each) {
        for_each([&](const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c) { cubes.mark(a, b, c); });
    });
    const std::vector<Place> places = cubes.places();
    constexpr std::array<UpAxis, 3> kAxes{UpAxis::x, UpAxis::y, UpAxis::z};
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (is_terrain(places, cubes.size(), axis))
            return {kAxes[axis], UpReason::terrain, 0, {}};
    std::array<double, 3> weights{}; // of the better base of an axis
    FoundUp best;
    std::size_t best_axis = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int height = cubes.size()[axis], base = std::max(1, (height + 12) / 25);
        const double lower = base_share(places, axis, 0, base - 1);
        const double upper = base_share(places, axis, height - base, height - 1);
        const bool stands = lower >= kUpsideDown * upper;
        weights[axis] = stands ? lower : kUpsideDown * upper;
        if (weights[axis] > weights[best_axis] || axis == 0) {
            best_axis = axis;
            best = {kAxes[axis], stands ? UpReason::base : UpReason::upper_base, stands ? lower : upper, {}};
        }
    }
    const double rival = std::max(weights[(best_axis + 1) % 3], weights[(best_axis + 2) % 3]);
    best.weights = weights;
    if (weights[best_axis] >= kMinShare && rival <= kMaxRival * weights[best_axis])
        return best;
    return {};
}

bool FoundUp::overrules(UpAxis other) const {
    constexpr double kClearShare = 0.6, kMaxOther = 0.1;
    const std::size_t axis = other == UpAxis::x ? 0 : other == UpAxis::y ? 1 : 2;
    return reason == UpReason::base && up != other && share >= kClearShare && weights[axis] <= kMaxOther;
}

std::string note_of(const FoundUp &found) {
    const std::string axis(to_string(found.up));
    const double percent = 100 * found.share;
    switch (found.reason) {
    case UpReason::base: return axis + formatted(": its base is %.0f %% of its outline", percent);
    case UpReason::upper_base:
        return axis +
               formatted(": its base, %.0f %% of its outline, is at the upper end; a model has no negative up axis",
                         percent);
    case UpReason::terrain: return axis + ": flat, as terrain is";
    case UpReason::none: break;
    }
    return axis + ", the default: it has no base and is no terrain; --up sets the axis";
}

} // namespace pbm::build
