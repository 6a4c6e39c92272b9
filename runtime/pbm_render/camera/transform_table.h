// Transforms an octree by additions: image of a child's centre = image of its parent's centre + M*d, one table entry.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>

namespace pbm {

// Screen space is homogeneous: (u, v, w) is the pixel (u / w, v / w), y downwards; w is the eye-space depth (distance
// along the view direction, model units). M maps model space to screen space.
struct Projection {
    Projection(const Camera &camera, int width, int height);

    glm::dvec3 point(glm::dvec3 model) const;  // M * (model, 1)
    glm::dvec3 vector(glm::dvec3 model) const; // M * (model, 0)
    // The plane with unit normal n as a linear function of pixels: for l = plane(n), l . (x, y, 1) is the cosine
    // between n and the ray through pixel (x, y), times the length of that ray at depth 1.
    glm::dvec3 plane(glm::dvec3 normal) const;

    // Ray from the eye through a pixel, model space, scaled to depth 1.
    glm::dvec3 ray(glm::dvec2 pixel) const;

    glm::dvec3 eye; // model space
    EyeAxes axes;
    double focal;      // pixels
    glm::dvec2 middle; // of the picture, pixels
    HalfSpaces clip;   // of the camera, model space
    bool shows_backs;  // points that face away from the eye are drawn, too
};

struct TransformTable {
    TransformTable(const Grid &grid, const Projection &projection);

    // Four numbers (u, v, w, 0) each, added by one instruction.
    glm::vec4 centre; // M*c of the whole cube
    // M*d from a node's centre to its child's: [level of the child][child]; index 0 is unused.
    std::array<std::array<glm::vec4, 8>, kMaxDepth + 1> child;
};

} // namespace pbm
