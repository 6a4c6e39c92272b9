// Triangulates polygons, also concave ones.
// Based on: Meisters. Polygons have ears. 1975
// Based on: Eberly. Triangulation by ear clipping. 2002
#pragma once

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

// Polygons with more corners are fanned from the first one, because ear clipping takes quadratic time.
constexpr std::size_t kMaxClippedCorners = 1024;

// Triangulates one polygon after the other; reuses its working memory.
class PolygonTriangulator {
  public:
    // Appends the triangles of the polygon, wound as it is. Returns the number of its `corners.size() - 2` triangles
    // that have fewer than three different corners and are omitted; 1 for a polygon of fewer than three corners. Every
    // corner is an index of `positions`.
    //
    // A polygon that is star-shaped around its first corner (every convex one, most quads) becomes a fan. Other
    // polygons are clipped ear by ear in the plane of Newell's normal, from the first corner on. Corners may share a
    // position (a slit to a hole); an outline that repeats itself counts once. If no ear remains (the outline crosses
    // itself, or has no area) the rest is fanned: it has no valid triangulation. A polygon with a non-finite corner is
    // fanned from that corner, so that all of it is dropped with the vertex.
    std::size_t triangulate(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions,
                            std::vector<glm::uvec3> &triangles);

  private:
    struct Corner {
        std::uint32_t vertex = 0;
        double x = 0, y = 0; // in the plane; counter-clockwise
        std::uint32_t previous = 0, next = 0;
        bool reflex = false;
    };

    std::size_t keep_one_lap();
    bool flatten(std::span<const glm::dvec3> positions);
    double turn(std::uint32_t corner) const;
    bool is_ear(std::uint32_t corner);
    void clip(std::vector<glm::uvec3> &triangles);
    bool fan_covers(std::span<const glm::dvec3> positions) const;
    void fan(std::size_t first, std::vector<glm::uvec3> &triangles) const;

    std::vector<std::uint32_t> vertices_; // of the polygon, no two equal ones in a row
    std::vector<Corner> corners_;
    glm::dvec3 normal_{0.0};
    double area_ = 0;            // twice the polygon's, in the plane
    std::size_t tests_left_ = 0; // of a corner against an ear
};

} // namespace pbm::build
