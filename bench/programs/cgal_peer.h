// CGAL's estimate of normals, in a file of its own because of its headers.
#pragma once

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace pbm::bench {

// Normals by planes through 18 neighbours, oriented along a minimum spanning tree of 18 neighbours, on one thread. Zero
// where CGAL does not orient them.
std::vector<glm::dvec3> cgal_normals(std::span<const glm::dvec3> points);

} // namespace pbm::bench
