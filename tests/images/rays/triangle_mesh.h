// Triangles to compare pictures with.
#pragma once

#include <glm/vec3.hpp>

#include <vector>

namespace pbm {

struct TriangleMesh {
    std::vector<glm::dvec3> positions; // model space
    std::vector<glm::uvec3> triangles; // counter-clockwise seen from outside
};

} // namespace pbm
