// Normal of a triangle in model space, bit for bit the same whichever corner the file names first.
#pragma once

#include <glm/vec3.hpp>

#include <cmath>
#include <utility>

namespace pbm::build {

// Not normalised: its length is twice the area. Outside is where the corners run counter-clockwise.
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
    const glm::dvec3 u = b - a, v = c - a;
    return {sign * (u.y * v.z - u.z * v.y), sign * (u.z * v.x - u.x * v.z), sign * (u.x * v.y - u.y * v.x)};
}

inline double length_of(const glm::dvec3 &v) { return std::sqrt((v.x * v.x + v.y * v.y) + v.z * v.z); }

} // namespace pbm::build
