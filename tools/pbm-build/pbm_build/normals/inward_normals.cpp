#include "pbm_build/normals/inward_normals.h"

#include "pbm_build/normals/fit_planes.h"
#include "pbm_build/normals/outside_view.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr double kMostlyInward = 2.0 / 3; // of the points; spheres have all, rooms and objects with folds fewer
constexpr double kSeen = 0.9;             // of the points: an object that hides few of them
constexpr double kFromBehind = 0.95;      // of those that are seen

// The share of the normals that look to the mean of all points.
double share_towards_mean(const std::vector<LatticePoint> &points, const std::vector<ShortNormal> &normals) {
    glm::dvec3 mean(0);
    for (const LatticePoint &p : points)
        mean += glm::dvec3(p) / static_cast<double>(points.size());
    std::size_t inward = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 to_mean = mean - glm::dvec3(points[i]);
        inward += to_mean.x * normals[i][0] + to_mean.y * normals[i][1] + to_mean.z * normals[i][2] > 0 ? 1U : 0U;
    }
    return static_cast<double>(inward) / static_cast<double>(points.size());
}

} // namespace

bool look_inwards(const PointNeighbours &neighbours, const std::vector<ShortNormal> &normals, int threads) {
    const std::vector<LatticePoint> &points = neighbours.points();
    if (share_towards_mean(points, normals) < kMostlyInward)
        return false;
    std::vector<float> spacing = fit_planes(neighbours, threads).links.spacing;
    const auto middle = spacing.begin() + static_cast<std::ptrdiff_t>(spacing.size() / 2);
    std::nth_element(spacing.begin(), middle, spacing.end());
    const OutsideView view = view_from_outside(points, normals, std::max(1.0, static_cast<double>(*middle)), threads);
    std::size_t seen = 0, from_behind = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        seen += view.seen[i] != 0 ? 1 : 0;
        from_behind += view.towards[i] < 0 ? 1 : 0;
    }
    return static_cast<double>(seen) >= kSeen * static_cast<double>(points.size()) &&
           static_cast<double>(from_behind) >= kFromBehind * static_cast<double>(seen);
}

} // namespace pbm::build
