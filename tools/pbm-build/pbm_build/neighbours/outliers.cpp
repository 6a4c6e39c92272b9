#include "pbm_build/neighbours/outliers.h"

#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 1024;

using Nearest = std::array<NearPoint, kSpacingNeighbours>;

float mean_distance(const Nearest &nearest) {
    double sum = 0;
    for (const NearPoint &near : nearest)
        sum += std::sqrt(near.squared_distance);
    return static_cast<float>(sum / static_cast<double>(nearest.size()));
}

// The spacing of each of `points`.
std::vector<float> spacings_of(const PointNeighbours &neighbours, std::span<const std::uint32_t> points, int threads) {
    std::vector<float> spacings(points.size());
    parallel_blocks(points.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        NeighbourCursor cursor(neighbours);
        Nearest nearest;
        for (std::size_t i = begin; i < end; ++i) {
            cursor.nearest(points[i], nearest);
            spacings[i] = mean_distance(nearest);
        }
    });
    return spacings;
}

// Between the points of a sample of `count`.
std::size_t sample_step(std::size_t count) { return std::max<std::size_t>(1, count / kSpacingSample); }

float median_spacing(const PointNeighbours &neighbours, int threads) {
    const std::size_t count = neighbours.points().size();
    std::vector<std::uint32_t> sample;
    for (std::size_t i = 0; i < count; i += sample_step(count))
        sample.push_back(static_cast<std::uint32_t>(i));
    return median_of(spacings_of(neighbours, sample, threads));
}

// The points whose spacing may be above `least`. No spacing is above the mean distance to any kSpacingNeighbours
// others, and that mean not above the root of the mean square.
std::vector<std::uint32_t> suspects(const PointNeighbours &neighbours, double least, int threads) {
    const std::vector<LatticePoint> &points = neighbours.points();
    const double most = static_cast<double>(kSpacingNeighbours) * least * least;
    const auto near_those_from = [&](std::size_t first, std::size_t point) {
        first = std::min(first, points.size() - kSpacingNeighbours - 1);
        double sum = 0;
        for (std::size_t k = first; k <= first + kSpacingNeighbours; ++k) {
            const glm::dvec3 d(points[k] - points[point]);
            sum += (d.x * d.x + d.y * d.y) + d.z * d.z;
        }
        return sum <= most;
    };
    Bytes suspected(points.size());
    parallel_blocks(points.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        NeighbourCursor cursor(neighbours);
        Nearest nearest;
        for (std::size_t i = begin; i < end; ++i) {
            if (near_those_from(i - std::min(i, kSpacingNeighbours / 2), i) ||
                near_those_from(i - std::min(i, kSpacingNeighbours), i) || near_those_from(i, i))
                continue;
            const bool few = cursor.nearest_in_order(i, nearest) < nearest.size();
            suspected[i] = few || static_cast<double>(mean_distance(nearest)) > least ? 1 : 0;
        }
    });
    std::vector<std::uint32_t> suspects;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (suspected[i] != 0)
            suspects.push_back(static_cast<std::uint32_t>(i));
    return suspects;
}

// For each of some points the median spacing of its nearest.
std::vector<float> median_spacings_around(const PointNeighbours &neighbours, std::span<const std::uint32_t> points,
                                          int threads) {
    std::vector<std::array<std::uint32_t, kSpacingNeighbours>> around(points.size());
    parallel_blocks(points.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        NeighbourCursor cursor(neighbours);
        Nearest nearest;
        for (std::size_t i = begin; i < end; ++i) {
            cursor.nearest(points[i], nearest);
            for (std::size_t k = 0; k < nearest.size(); ++k)
                around[i][k] = nearest[k].point;
        }
    });
    std::vector<std::uint32_t> each; // of all of them once: outliers come in clusters
    for (const auto &some : around)
        each.insert(each.end(), some.begin(), some.end());
    std::sort(each.begin(), each.end());
    each.erase(std::unique(each.begin(), each.end()), each.end());
    const std::vector<float> spacings = spacings_of(neighbours, each, threads);
    std::vector<float> medians;
    for (const auto &some : around) {
        std::vector<float> theirs;
        theirs.reserve(some.size());
        for (const std::uint32_t point : some)
            theirs.push_back(
                spacings[static_cast<std::size_t>(std::lower_bound(each.begin(), each.end(), point) - each.begin())]);
        medians.push_back(median_of(std::move(theirs)));
    }
    return medians;
}

} // namespace

float median_of(std::vector<float> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

Bytes find_outliers(std::span<const float> spacings, std::span<const std::uint32_t> nearest) {
    const std::size_t count = spacings.size();
    Bytes outliers(count);
    if (count <= kSpacingNeighbours)
        return outliers;
    std::vector<float> sample;
    for (std::size_t i = 0; i < count; i += sample_step(count))
        sample.push_back(spacings[i]);
    const double least = kOutlierFactor * static_cast<double>(median_of(std::move(sample)));
    for (std::size_t i = 0; i < count; ++i)
        if (const auto spacing = static_cast<double>(spacings[i]); spacing > least) {
            std::vector<float> theirs;
            for (const std::uint32_t point : nearest.subspan(i * kSpacingNeighbours, kSpacingNeighbours))
                theirs.push_back(spacings[point]);
            outliers[i] = spacing > kOutlierFactor * static_cast<double>(median_of(std::move(theirs))) ? 1 : 0;
        }
    return outliers;
}

Bytes find_outliers(const PointNeighbours &neighbours, int threads) {
    Bytes outliers(neighbours.points().size());
    if (outliers.size() <= kSpacingNeighbours)
        return outliers;
    const double least = kOutlierFactor * static_cast<double>(median_spacing(neighbours, threads));
    std::vector<std::uint32_t> far = suspects(neighbours, least, threads);
    std::vector<float> spacings = spacings_of(neighbours, far, threads);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < far.size(); ++i)
        if (static_cast<double>(spacings[i]) > least) {
            far[kept] = far[i];
            spacings[kept++] = spacings[i];
        }
    far.resize(kept);
    const std::vector<float> medians = median_spacings_around(neighbours, far, threads);
    for (std::size_t i = 0; i < far.size(); ++i)
        outliers[far[i]] = static_cast<double>(spacings[i]) > kOutlierFactor * static_cast<double>(medians[i]) ? 1 : 0;
    return outliers;
}

} // namespace pbm::build
