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
    for (std::uint32_t i = 0; i < count; ++i) {
        const glm::dvec3 p = positions[vertices_[i]] - positions[vertices_[0]];
        corners_[i] = {.vertex = vertices_[i],
                       .x = sign * p[u],
                       .y = p[v],
                       .previous = i == 0 ? count - 1 : i - 1,
                       .next = i + 1 == count ? 0 : i + 1};
    }
    for (std::uint32_t i = 0; i < count; ++i)
        corners_[i].reflex = turn(i) <= 0;
    area_ = size[dropped];
    return std::isfinite(normal_.x + normal_.y + normal_.z) && normal_[dropped] != 0;
}

// Twice the area of the triangle at a corner: positive where the outline turns left.
double PolygonTriangulator::turn(std::uint32_t corner) const {
    const Corner &c = corners_[corner], &p = corners_[c.previous], &n = corners_[c.next];
    return (c.x - p.x) * (n.y - p.y) - (c.y - p.y) * (n.x - p.x);
}

// An ear turns left and its triangle contains no other corner; only reflex corners can lie in it.
bool PolygonTriangulator::is_ear(std::uint32_t corner) {
    const Corner &b = corners_[corner], &a = corners_[b.previous], &c = corners_[b.next];
    if (b.reflex)
        return false;
    const auto left_of = [](const Corner &from, const Corner &to, const Corner &p) {
        return (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x) >= 0;
    };
    const auto same_place = [](const Corner &p, const Corner &q) { return p.x == q.x && p.y == q.y; };
    for (std::uint32_t i = c.next; i != b.previous; i = corners_[i].next) {
        const Corner &p = corners_[i];
        tests_left_ -= tests_left_ == 0 ? 0 : 1;
        if (p.reflex && left_of(a, b, p) && left_of(b, c, p) && left_of(c, a, p) && !same_place(p, a) &&
            !same_place(p, b) && !same_place(p, c))
            return false;
    }
    return true;
}

void PolygonTriangulator::clip(std::vector<glm::uvec3> &triangles) {
    std::size_t left = corners_.size();
    tests_left_ = 8 * left * left;
    std::uint32_t at = 0;
    std::size_t passed = 0; // corners since the last ear
    const auto cut = [&](std::uint32_t corner) {
        const Corner c = corners_[corner];
        triangles.emplace_back(corners_[c.previous].vertex, c.vertex, corners_[c.next].vertex);
        corners_[c.previous].next = c.next;
        corners_[c.next].previous = c.previous;
        for (const std::uint32_t neighbour : {c.previous, c.next})
            corners_[neighbour].reflex = turn(neighbour) <= 0;
        --left;
        passed = 0;
        at = c.next;
    };
    while (left > 3 && passed < 2 * left && tests_left_ != 0) {
        const bool no_ears = passed >= left; // then corners in a line, or at the end of a way there and back
        if (no_ears ? std::abs(turn(at)) <= kRounding * area_ : is_ear(at)) {
            cut(at);
        } else {
            at = corners_[at].next;
            ++passed;
        }
    }
    for (std::uint32_t second = corners_[at].next; left > 2; --left, second = corners_[second].next)
        triangles.emplace_back(corners_[at].vertex, corners_[second].vertex, corners_[corners_[second].next].vertex);
}

std::size_t PolygonTriangulator::triangulate(std::span<const std::uint32_t> corners,
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
    } else if (count == 3 || count > kMaxClippedCorners) {
        fan(0, triangles);
    } else if (count == 4) {
        const bool first = first_diagonal_is_inside(positions[vertices_[0]], positions[vertices_[1]],
                                                    positions[vertices_[2]], positions[vertices_[3]]);
        fan(first ? 0 : 1, triangles);
    } else {
        normal_ = glm::dvec3(0.0);
        for (std::size_t i = 2; i < count; ++i)
            normal_ += area_vector(positions[vertices_[0]], positions[vertices_[i - 1]], positions[vertices_[i]]);
        if (fan_covers(positions) || !flatten(positions))
            fan(0, triangles);
        else
            clip(triangles);
    }
    // Corners that are the same vertex further along the outline.
    const auto flat = [](const glm::uvec3 &t) { return t.x == t.y || t.y == t.z || t.x == t.z; };
    triangles.erase(std::remove_if(triangles.begin() + static_cast<std::ptrdiff_t>(begin), triangles.end(), flat),
                    triangles.end());
    return corners.size() - 2 - (triangles.size() - begin);
}

} // namespace pbm::build
