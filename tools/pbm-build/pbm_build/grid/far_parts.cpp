#include "pbm_build/grid/far_parts.h"

#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/surface/face_normal.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "system/bytes.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

namespace pbm::build {

bool bulk_is_small(const BoxBins &counts, std::uint64_t few) {
    return std::all_of(counts.begin(), counts.end(), [&](const auto &bins) {
        std::size_t first = 0, last = kBoxBins - 1;
        for (std::uint64_t seen = bins[first]; seen <= few; seen += bins[first])
            ++first;
        for (std::uint64_t seen = bins[last]; seen <= few; seen += bins[last])
            --last;
        return static_cast<double>(last - first) * kStrayFactor <= static_cast<double>(kBoxBins);
    });
}

namespace {

// Classes of distances: sign, exponent and the two highest fraction bits of the double. Four of them span an octave.
constexpr int kClassShift = 50, kClassesPerOctave = 4;
constexpr std::size_t kClasses = std::size_t{1} << (63 - kClassShift);

std::size_t class_of(double distance) {
    return static_cast<std::size_t>(std::bit_cast<std::uint64_t>(distance) >> kClassShift);
}
double least_of(std::size_t index) { return std::bit_cast<double>(static_cast<std::uint64_t>(index) << kClassShift); }

// [positions] 1: a corner of a triangle, or a point.
Bytes used_positions(const Surface &surface) {
    Bytes used(surface.positions.size());
    for (const glm::uvec3 &t : surface.triangles)
        used[t.x] = used[t.y] = used[t.z] = 1;
    std::fill(used.begin() + static_cast<std::ptrdiff_t>(surface.first_point()), used.end(), std::uint8_t{1});
    return used;
}

// Whether the box of all is at least kStrayFactor times longer than that of all but 1 / kStrayShare at each end of each
// axis. Without that there are no far parts; to find them takes longer.
bool is_concentrated(const Surface &surface, const Bytes &used, const Bounds &bounds) {
    const double extent = bounds.extent();
    if (!(extent > 0) || !std::isfinite(extent))
        return extent > 0;
    BoxBins counts{};
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < used.size(); ++i) {
        if (used[i] == 0)
            continue;
        ++all;
        const glm::dvec3 from_corner = (surface.positions[i] - bounds.lowest) / extent * double{kBoxBins};
        for (int axis = 0; axis < 3; ++axis)
            ++counts[static_cast<std::size_t>(axis)]
                    [std::min(static_cast<std::size_t>(from_corner[axis]), kBoxBins - 1)];
    }
    return bulk_is_small(counts, all / kStrayShare);
}

glm::dvec3 median_of(const Surface &surface, const Bytes &used) {
    glm::dvec3 median(0);
    std::vector<double> values;
    for (int axis = 0; axis < 3; ++axis) {
        values.clear();
        for (std::size_t i = 0; i < used.size(); ++i)
            if (used[i] != 0)
                values.push_back(surface.positions[i][axis]);
        const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        median[axis] = *middle;
    }
    return median;
}

double distance_of(const glm::dvec3 &p, const glm::dvec3 &median) {
    const glm::dvec3 d = glm::abs(p - median);
    return std::max({d.x, d.y, d.z});
}

// Marks far positions by 2 in `used`. Returns how many times longer they make the box; 0 if there are none.
double mark_far(const Surface &surface, const Bounds &bounds, Bytes &used) {
    const glm::dvec3 median = median_of(surface, used);
    std::vector<std::uint64_t> counts(kClasses);
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < used.size(); ++i)
        if (used[i] != 0) {
            ++counts[class_of(distance_of(surface.positions[i], median))];
            ++all;
        }
    std::size_t index = 0, empty = 0;
    for (std::uint64_t seen = 0; index < kClasses && empty < kClassesPerOctave; ++index) {
        seen += counts[index];
        empty = counts[index] == 0 && (all - seen) * kStrayShare <= all ? empty + 1 : 0;
    }
    const double limit = least_of(std::min(index, kClasses - 1));
    std::optional<Bounds> near;
    for (std::size_t i = 0; i < used.size(); ++i) {
        if (used[i] == 0)
            continue;
        const glm::dvec3 &p = surface.positions[i];
        if (distance_of(p, median) >= limit)
            used[i] = 2;
        else if (near)
            near = Bounds{glm::min(near->lowest, p), glm::max(near->highest, p)};
        else
            near = Bounds{p, p};
    }
    return near && near->extent() > 0 ? bounds.extent() / near->extent() : 0;
}

// Whether the faces at far vertices may be part of the scene.
bool may_belong(const Surface &surface, const Bytes &used, double length_of_rest) {
    double area = 0, far_area = 0;
    for (const glm::uvec3 &t : surface.triangles) {
        const std::array<glm::dvec3, 3> corners{surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]};
        const int far = (used[t.x] == 2 ? 1 : 0) + (used[t.y] == 2 ? 1 : 0) + (used[t.z] == 2 ? 1 : 0);
        if (far == 0 || far == 3)
            (far == 0 ? area : far_area) += glm::length(face_normal(corners[0], corners[1], corners[2]));
        else if (std::min({glm::distance(corners[0], corners[1]), glm::distance(corners[1], corners[2]),
                           glm::distance(corners[2], corners[0])}) > length_of_rest)
            return true;
    }
    return far_area * static_cast<double>(kStrayShare) > area;
}

std::string counts_text(std::size_t faces, std::size_t points) {
    std::string text = faces > 0 ? counted(faces, "face") : "";
    if (points > 0)
        text += (faces > 0 ? " and " : "") + counted(points, "point");
    return text + " far from all others";
}

} // namespace

Status drop_far_parts(Surface &surface, bool strict, BuildStatistics &statistics) {
    Bytes used = used_positions(surface);
    const Bounds bounds = bounds_of(surface);
    if (!is_concentrated(surface, used, bounds))
        return {};
    const double growth = mark_far(surface, bounds, used);
    if (growth < kStrayFactor)
        return {};
    const auto is_far = [&](const glm::uvec3 &t) { return used[t.x] == 2 || used[t.y] == 2 || used[t.z] == 2; };
    const auto faces =
        static_cast<std::size_t>(std::count_if(surface.triangles.begin(), surface.triangles.end(), is_far));
    const auto points = static_cast<std::size_t>(
        std::count(used.begin() + static_cast<std::ptrdiff_t>(surface.first_point()), used.end(), std::uint8_t{2}));
    const bool all_faces = faces > 0 && faces == surface.triangles.size();
    if (all_faces || (growth < kDamageFactor && may_belong(surface, used, bounds.extent() / growth))) {
        statistics.report(Warning::kept_outliers, "outliers",
                          counts_text(faces, points) +
                              formatted(", with which the grid is %.3g times larger: large enough to be part of the "
                                        "scene; if they are not, remove them from the scan",
                                        growth));
        return {};
    }
    const std::string note =
        counts_text(faces, points) +
        formatted(", with which the grid would be %.3g times larger; --keep-outliers keeps them", growth);
    if (strict)
        return bad_input(note);
    statistics.report(Warning::stray_points, "outliers", note);
    surface.closed = surface.closed && faces == 0; // they may be connected with the rest
    erase_triangles(surface, is_far);
    const std::size_t first = surface.first_point();
    const auto keep = [&](std::size_t i) { return used[i] != 2; };
    for_vertex_attributes([&](auto &values) { keep_from(values, first, keep); }, surface);
    keep_from(surface.positions, first, keep);
    if (!surface.triangles.empty())
        surface.points_beside_triangles = surface.positions.size() - first;
    return {};
}

} // namespace pbm::build
