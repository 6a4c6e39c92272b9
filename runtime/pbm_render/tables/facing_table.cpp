#include "pbm_render/tables/facing_table.h"

#include "pbm_format/model/normal.h"
#include "pbm_render/camera/normal_table.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <span>

namespace pbm {

void mark_facing(const glm::dvec3 &eye, const glm::dvec3 &centre, double half_edge, std::vector<Facing> &facing) {
    facing.assign(std::max(facing.size(), std::size_t{2 * kNormalCount}), Facing::both);
    const glm::dvec3 sight = centre - eye;
    // n . (x - eye) has its extremes over the cube at corners; the slack grows with the distance of the point.
    const double slack = static_cast<double>(kFacingSlack) * (glm::length(sight) + half_edge * std::sqrt(3.0));
    const std::span<const UnitVector> table = normal_table();
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = table[i];
        const double middle = n[0] * sight.x + n[1] * sight.y + n[2] * sight.z;
        const double spread = half_edge * (std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]));
        facing[i] = middle - spread > slack ? Facing::away : middle + spread < 0 ? Facing::front : Facing::some;
    }
}

} // namespace pbm
