#include "pbm_render/camera/camera.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace pbm {

HalfSpaces::HalfSpaces(const ClipRegion &region) : half_spaces_{} {
    if (region.plane) {
        const glm::dvec3 normal = glm::normalize(region.plane->normal);
        half_spaces_[count_++] = {normal, -glm::dot(normal, region.plane->point)};
    }
    if (region.box)
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 inwards(0);
            inwards[axis] = 1;
            half_spaces_[count_++] = {inwards, -region.box->least[axis]};
            half_spaces_[count_++] = {-inwards, region.box->most[axis]};
        }
}

HalfSpaces::Side HalfSpaces::side_of(const glm::dvec3 &centre, const glm::dvec3 &half_edges) const {
    Side side = Side::inside;
    for (const auto &[normal, offset] : all()) {
        const double distance = glm::dot(normal, centre) + offset, reach = glm::dot(half_edges, glm::abs(normal));
        if (distance < -reach)
            return Side::outside;
        if (distance < reach)
            side = Side::cut;
    }
    return side;
}

} // namespace pbm
