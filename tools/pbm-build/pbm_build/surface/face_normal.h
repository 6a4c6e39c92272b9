// Normal of a triangle in model space, bit for bit the same for any order of its corners.
#pragma once

#include <glm/geometric.hpp>

#include <utility>

namespace pbm::build {

// Not normalised: the length is twice the area. Points to the side from which the corners run counter-clockwise.
inline glm::dvec3 face_normal(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    double sign = 1;
    const auto order = [&](glm::dvec3 &p, glm::dvec3 &q) {
        if (q.x != p.x ? q.x < p.x : q.y != p.y ? q.y < p.y : q.z < p.z) {
            std::swap(p, q);
            sign = -sign;
        }
    };
    order(a, b);
    order(b, c);
    order(a, b);
    return sign * glm::cross(b - a, c - a);
}

} // namespace pbm::build
