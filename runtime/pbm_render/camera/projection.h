// The map from model space to the screen that a camera and a picture's size define.
#pragma once

#include "pbm_render/camera/camera.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

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
    double focal;          // pixels
    glm::dvec2 middle;     // of the picture, pixels
    HalfSpaces clip;       // of the camera, model space
    bool shows_backs;      // points that face away from the eye are drawn, too
    bool has_round_points; // tables of normals hold kDrawnNormals entries, else kNormalCount
};

} // namespace pbm
