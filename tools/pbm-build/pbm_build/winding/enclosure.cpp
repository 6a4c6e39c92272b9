#include "pbm_build/winding/enclosure.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <numeric>

namespace pbm::build {
namespace {

// Whether the ray from (y, z) along +z crosses the segment from p to q in the y-z plane. The ends are put in order
// before, so that two triangles at one edge agree.
bool crosses(const glm::dvec3 *p, const glm::dvec3 *q, double y, double z) {
    if ((p->y > y) == (q->y > y))
        return false;
    if (p->y > q->y)
        std::swap(p, q);
    return p->z + (y - p->y) / (q->y - p->y) * (q->z - p->z) > z;
}

// 1: the ray from `point` along +x leaves the volume through the triangle; -1: it enters; 0: it misses.
int crossing(const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c, const glm::dvec3 &point) {
    const bool inside =
        crosses(&a, &b, point.y, point.z) != (crosses(&b, &c, point.y, point.z) != crosses(&c, &a, point.y, point.z));
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    if (!inside || normal.x == 0)
        return 0;
    const double x = a.x - (normal.y * (point.y - a.y) + normal.z * (point.z - a.z)) / normal.x;
    return x <= point.x ? 0 : normal.x > 0 ? 1 : -1;
}

} // namespace

std::vector<int> winding_numbers(const Surface &surface, std::span<const std::int8_t> signs,
                                 std::span<const glm::dvec3> points) {
    std::vector<std::size_t> order(points.size()); // by y
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return points[i].y < points[j].y; });
    std::vector<int> numbers(points.size());
    for (std::size_t i = 0; i < signs.size(); ++i) {
        if (signs[i] == 0)
            continue;
        const glm::uvec3 &t = surface.triangles[i];
        const glm::dvec3 &a = surface.positions[t.x], &b = surface.positions[t.y], &c = surface.positions[t.z];
        const double lowest = std::min({a.y, b.y, c.y}), highest = std::max({a.y, b.y, c.y});
        auto at = std::lower_bound(order.begin(), order.end(), lowest,
                                   [&](std::size_t point, double y) { return points[point].y < y; });
        for (; at != order.end() && points[*at].y <= highest; ++at)
            numbers[*at] += signs[i] * crossing(a, b, c, points[*at]);
    }
    return numbers;
}

} // namespace pbm::build
