#include "pbm_scan/surface/polygon.h"

#include "pbm_scan/surface/surface.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace pbm::build {
namespace {

constexpr double kRounding = 1e-12; // relative to the polygon's area: a triangle below it counts as degenerate

glm::dvec3 area_vector(const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c) {
    return glm::cross(b - a, c - a);
}

// The diagonal 0-2 of a quad lies inside if both of its triangles face the same side; else the diagonal 1-3 does.
bool first_diagonal_is_inside(const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c, const glm::dvec3 &d) {
    if (glm::dot(area_vector(a, b, c), area_vector(a, c, d)) >= 0)
        return true;
    return !(glm::dot(area_vector(b, c, d), area_vector(b, d, a)) > 0); // neither: the outline crosses itself
}

} // namespace

// Truncates an outline that repeats itself to its first lap. Returns the number of its corners.
std::size_t PolygonTriangulator::keep_one_lap() {
    const std::size_t count = vertices_.size();
    for (std::size_t lap = 3; lap <= count / 2; ++lap)
        if (vertices_[lap] == vertices_[0] && count % lap == 0 &&
            std::equal(vertices_.begin() + static_cast<std::ptrdiff_t>(lap), vertices_.end(), vertices_.begin())) {
            vertices_.resize(lap);
            break;
        }
    return vertices_.size();
}

void PolygonTriangulator::fan(std::size_t first, std::vector<glm::uvec3> &triangles) const {
    const std::size_t count = vertices_.size();
    for (std::size_t i = 1; i + 1 < count; ++i)
        triangles.emplace_back(vertices_[first], vertices_[(first + i) % count], vertices_[(first + i + 1) % count]);
}

// Whether every triangle of the fan from the first corner faces the same side as the polygon, up to rounding.
bool PolygonTriangulator::fan_covers(std::span<const glm::dvec3> positions) const {
    const glm::dvec3 first = positions[vertices_[0]];
    const double whole = glm::dot(normal_, normal_);
    for (std::size_t i = 2; i < vertices_.size(); ++i)
        if (!(glm::dot(area_vector(first, positions[vertices_[i - 1]], positions[vertices_[i]]), normal_) >=
              -kRounding * whole))
            return false;
    return true;
}

// Projects along the longest axis of the normal, which keeps the coordinates exact. False if the polygon has no area.
bool PolygonTriangulator::flatten(std::span<const glm::dvec3> positions) {
    const glm::dvec3 size = glm::abs(normal_);
    const int dropped = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = (dropped + 1) % 3, v = (dropped + 2) % 3;
    const double sign = normal_[dropped] < 0 ? -1.0 : 1.0;
    const auto count = static_cast<std::uint32_t>(vertices_.size());
    corners_.resize(count);
    points_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        const glm::dvec3 p = positions[vertices_[i]] - positions[vertices_[0]];
        points_[i] = {sign * p[u], p[v]};
        corners_[i] = {
            .vertex = vertices_[i], .previous = i == 0 ? count - 1 : i - 1, .next = i + 1 == count ? 0 : i + 1};
    }
    area_ = size[dropped];
    return std::isfinite(normal_.x + normal_.y + normal_.z) && normal_[dropped] != 0;
}

// Positive where the outline turns left.
double PolygonTriangulator::turn(std::uint32_t corner) const {
    const Corner &c = corners_[corner];
    return turn_of(points_[c.previous], points_[corner], points_[c.next]);
}

// Notes what a corner is, after a neighbour was cut.
void PolygonTriangulator::classify(std::uint32_t corner) {
    const double angle = turn(corner);
    const bool reflex = angle <= 0;
    corners_[corner].reflex = reflex;
    reflex_.set(corner, reflex);
    if (std::abs(angle) <= kRounding * area_)
        straight_.insert(corner);
    else
        straight_.erase(corner);
    candidates_.insert(corner);
    if (!reflex) {
        candidates_.insert(waiting_[corner].begin(), waiting_[corner].end());
        waiting_[corner].clear();
    }
}

// An ear turns left and its triangle contains no other corner; only reflex corners can lie in it.
bool PolygonTriangulator::is_ear(std::uint32_t corner) {
    const Corner &c = corners_[corner];
    if (c.reflex)
        return false;
    const auto inside = reflex_.find_in({points_[c.previous], points_[corner], points_[c.next]}, boxes_left_);
    if (inside)
        waiting_[*inside].push_back(corner);
    return !inside;
}

// Returns the corner to go on from. In a large polygon that is not the next one, so that round outlines do not become
// fans, whose triangles are long.
std::uint32_t PolygonTriangulator::cut(std::uint32_t corner, std::vector<glm::uvec3> &triangles) {
    const Corner c = corners_[corner];
    triangles.emplace_back(corners_[c.previous].vertex, c.vertex, corners_[c.next].vertex);
    corners_[c.previous].next = c.next;
    corners_[c.next].previous = c.previous;
    corners_[corner].reflex = true; // no ear any more
    candidates_.erase(corner);
    straight_.erase(corner);
    reflex_.set(corner, false);
    candidates_.insert(waiting_[corner].begin(), waiting_[corner].end());
    waiting_[corner].clear();
    classify(c.previous);
    classify(c.next);
    return corners_.size() > kMaxFannedCorners ? corners_[c.next].next : c.next;
}

void PolygonTriangulator::clip(std::vector<glm::uvec3> &triangles) {
    std::size_t left = corners_.size();
    boxes_left_ = kMaxBoxes * left;
    reflex_.reset(points_);
    candidates_.clear();
    straight_.clear();
    waiting_.assign(left, {});
    for (std::uint32_t i = 0; i < left; ++i)
        classify(i);
    std::uint32_t at = 0;
    // The first of `corners` from `at` on, around the outline.
    const auto next_of = [&](const std::set<std::uint32_t> &corners) {
        const auto found = corners.lower_bound(at);
        return found == corners.end() ? *corners.begin() : *found;
    };
    while (left > 3 && boxes_left_ != 0 && !(candidates_.empty() && straight_.empty())) {
        const bool no_ears = candidates_.empty();
        const std::uint32_t corner = next_of(no_ears ? straight_ : candidates_);
        candidates_.erase(corner);
        if (!no_ears && !is_ear(corner))
            continue;
        at = cut(corner, triangles);
        --left;
    }
    if (left > kMaxFannedCorners)
        return;
    for (std::uint32_t second = corners_[at].next; left > 2; --left, second = corners_[second].next)
        triangles.emplace_back(corners_[at].vertex, corners_[second].vertex, corners_[corners_[second].next].vertex);
}

std::size_t PolygonTriangulator::triangulate_polygon(std::span<const std::uint32_t> corners,
                                                     std::span<const glm::dvec3> positions,
                                                     std::vector<glm::uvec3> &triangles) {
    if (corners.size() < 3)
        return 1;
    vertices_.clear();
    for (const std::uint32_t corner : corners) {
        assert(corner < positions.size());
        if (vertices_.empty() || vertices_.back() != corner)
            vertices_.push_back(corner);
    }
    while (vertices_.size() > 1 && vertices_.back() == vertices_.front())
        vertices_.pop_back();
    const std::size_t begin = triangles.size(), count = keep_one_lap();
    if (count < 3)
        return corners.size() - 2;

    const auto not_finite = std::find_if(vertices_.begin(), vertices_.end(),
                                         [&](std::uint32_t vertex) { return !is_finite(positions[vertex]); });
    if (not_finite != vertices_.end()) {
        fan(static_cast<std::size_t>(not_finite - vertices_.begin()), triangles);
    } else if (count == 3) {
        fan(0, triangles);
    } else if (count == 4) {
        const bool first = first_diagonal_is_inside(positions[vertices_[0]], positions[vertices_[1]],
                                                    positions[vertices_[2]], positions[vertices_[3]]);
        fan(first ? 0 : 1, triangles);
    } else {
        normal_ = glm::dvec3(0.0);
        for (std::size_t i = 2; i < count; ++i)
            normal_ += area_vector(positions[vertices_[0]], positions[vertices_[i - 1]], positions[vertices_[i]]);
        const bool may_fan = count <= kMaxFannedCorners;
        const bool fans = may_fan && fan_covers(positions);
        if (!fans && flatten(positions))
            clip(triangles);
        else if (may_fan)
            fan(0, triangles);
    }
    // Corners that are the same vertex further along the outline.
    const auto flat = [](const glm::uvec3 &t) { return t.x == t.y || t.y == t.z || t.x == t.z; };
    triangles.erase(std::remove_if(triangles.begin() + static_cast<std::ptrdiff_t>(begin), triangles.end(), flat),
                    triangles.end());
    return corners.size() - 2 - (triangles.size() - begin);
}

} // namespace pbm::build
