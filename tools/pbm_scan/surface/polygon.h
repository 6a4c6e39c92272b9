// Triangulates polygons, also concave ones.
// Based on: Meisters. Polygons have ears. 1975
// Based on: Eberly. Triangulation by ear clipping. 2002
#pragma once

#include "pbm_scan/surface/reflex_corners.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

namespace pbm::build {

// What cannot be clipped is fanned, but not where more corners are left: their fan would cover the plane many times.
constexpr std::size_t kMaxFannedCorners = 1024;

// Triangulates one polygon after the other; reuses its working memory.
class PolygonTriangulator {
  public:
    // Appends the triangles of the polygon, wound as it is. Returns the number of its `corners.size() - 2` triangles
    // that have fewer than three different corners or cannot be clipped, and are omitted; 1 for a polygon of fewer than
    // three corners. Every corner is an index of `positions`.
    //
    // A polygon that is star-shaped around its first corner (every convex one, most quads) becomes a fan. Other
    // polygons are clipped ear by ear in the plane of Newell's normal, from the first corner on. Corners may share a
    // position (a slit to a hole); an outline that repeats itself counts once. If no ear remains (the outline crosses
    // itself, or has no area) there is no valid triangulation: a rest of at most kMaxFannedCorners is fanned, a larger
    // one omitted. The time is about n log n, and never more than kMaxBoxes n steps. A polygon with a non-finite corner
    // is fanned from that corner, so that all of it is dropped with the vertex.
    std::size_t triangulate(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions,
                            std::vector<glm::uvec3> &triangles) {
        if (corners.size() == 3 && corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) {
            triangles.emplace_back(corners[0], corners[1], corners[2]);
            return 0;
        }
        return triangulate_polygon(corners, positions, triangles);
    }

  private:
    std::size_t triangulate_polygon(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions,
                                    std::vector<glm::uvec3> &triangles);

    // Boxes of ReflexCorners that are visited, per corner of the polygon.
    static constexpr std::size_t kMaxBoxes = 2048;

    struct Corner {
        std::uint32_t vertex = 0, previous = 0, next = 0;
        bool reflex = false;
    };

    std::size_t keep_one_lap();
    bool flatten(std::span<const glm::dvec3> positions);
    double turn(std::uint32_t corner) const;
    void classify(std::uint32_t corner);
    bool is_ear(std::uint32_t corner);
    std::uint32_t cut(std::uint32_t corner, std::vector<glm::uvec3> &triangles);
    void clip(std::vector<glm::uvec3> &triangles);
    bool fan_covers(std::span<const glm::dvec3> positions) const;
    void fan(std::size_t first, std::vector<glm::uvec3> &triangles) const;

    std::vector<std::uint32_t> vertices_; // of the polygon, no two equal ones in a row
    std::vector<Corner> corners_;
    std::vector<PlanePoint> points_; // of the corners, in the plane; counter-clockwise
    ReflexCorners reflex_;
    std::set<std::uint32_t> candidates_; // corners that may be ears
    std::set<std::uint32_t> straight_;   // corners in a line, or at the end of a way there and back
    std::vector<std::vector<std::uint32_t>>
        waiting_; // [corners] that are no ears because this reflex corner is in them
    glm::dvec3 normal_{0.0};
    double area_ = 0; // twice the polygon's, in the plane
    std::size_t boxes_left_ = 0;
};

} // namespace pbm::build
