// Polygons to triangles that cover what the polygon covers: concave ones are not fanned over their notches.
// Based on: Meisters. Polygons have ears. 1975
// Based on: Eberly. Triangulation by ear clipping. 2002
#pragma once

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

// Of more corners polygons are fanned from the first one: ear clipping takes the square of their number.
constexpr std::size_t kMaxClippedCorners = 1024;

// Triangulates polygons one after the other; keeps its working memory between them.
class PolygonTriangulator {
  public:
    // Appends the triangles of the polygon, wound as it is, and returns how many of its `corners.size() - 2` have fewer
    // than three different corners and are left out; a polygon of fewer than three corners counts as one of these.
    // Every corner is an index of `positions`.
    //
    // A polygon that its first corner sees as a whole (every convex one, most quads) becomes a fan from there. Others
    // are clipped ear by ear in the plane of Newell's normal, going round the outline from the first corner. Corners at
    // the same place are allowed (a hole is reached by a slit); an outline that goes round more than once counts once.
    // Where no ear is left (the outline crosses itself, or has no area) the rest is fanned: no triangulation of it is
    // right. A polygon with a corner that is not finite is fanned from that corner, so that it goes as a whole with the
    // vertex.
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
