// Triangles on the lattice: results in integers that do not depend on the order of the corners.
#pragma once

#include "pbm_build/lattice/lattice.h"

#include <array>
#include <utility>

namespace pbm::build {

// Normal from exact integers, towards the side from which the corners run counter-clockwise; zero for area zero.
inline glm::dvec3 lattice_normal(const LatticePoint &a, const LatticePoint &b, const LatticePoint &c) {
    const glm::i64vec3 u = glm::i64vec3(b) - glm::i64vec3(a), v = glm::i64vec3(c) - glm::i64vec3(a);
    return glm::dvec3(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
}

template <class Place> bool before(const Place &a, const Place &b) { // by x, then y, then z
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

inline glm::dvec3 in_voxels(const LatticePoint &p) { return glm::dvec3(p) * (1 / kLatticeSteps); }

template <class T, class Less> void sort_three(std::array<T, 3> &items, Less less) {
    if (less(items[1], items[0]))
        std::swap(items[0], items[1]);
    if (less(items[2], items[1]))
        std::swap(items[1], items[2]);
    if (less(items[1], items[0]))
        std::swap(items[0], items[1]);
}

} // namespace pbm::build
