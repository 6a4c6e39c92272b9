// The surface through some points near a place: a quadratic height field over a reference plane.
// Based on: Alexa, Behr, Cohen-Or, Fleishman, Levin, Silva. Computing and Rendering Point Set Surfaces. 2003
#pragma once

#include <glm/vec3.hpp>

#include <optional>
#include <span>

namespace pbm::build {

struct WeightedPoint {
    glm::dvec3 offset; // from the place, in units in which the farthest offset is about 1
    glm::dvec3 normal; // of the side of the surface that is fitted
    double weight;     // > 0
};

struct SurfaceFoot {
    glm::dvec3 offset; // of the surface from the place, along the normal of the reference plane
    glm::dvec3 normal; // of the surface there; unit vector
};

// Fits the heights of `points` above the plane through the place whose normal is their mean one, and returns the
// surface at the place. Null where the points lie on a line, or fewer than three are given.
std::optional<SurfaceFoot> moving_least_squares(std::span<const WeightedPoint> points);

} // namespace pbm::build
