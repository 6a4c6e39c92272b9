// Ray casting against triangles: the truth for pictures.
#pragma once

#include "pbm_render/camera/camera.h"
#include "triangle_mesh.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace pbm {

// [height][width], top row first.
struct RayImage {
    std::vector<float> depths;        // of the nearest triangle along the view direction, +infinity where there is none
    std::vector<std::uint8_t> inside; // 1: the ray meets the triangle's back, so the mesh is open there
    std::vector<float> cosines;       // between the ray and the triangle's normal, 0..1; 0 where there is none
};

// The nearest intersection of a ray.
struct RayHit {
    float distance; // in lengths of the ray's direction
    std::size_t triangle;
    glm::vec3 weights; // barycentric, of the corners
    glm::vec3 face;    // unit normal on the side from which the corners run counter-clockwise
};

// Rays through the pixels of a picture.
struct PixelRays {
    PixelRays(const Camera &camera, int width, int height);

    // Direction with length 1 along the view direction, so that ray parameter = depth. Pixel (0, 0) covers 0..1 x 0..1.
    glm::dvec3 through(double x, double y) const { return corner_ + x * right_ + y * down_; }

    glm::dvec3 eye; // model space

  private:
    glm::dvec3 corner_, right_, down_;
};

class RayCaster {
  public:
    // `centre` is subtracted from every position, so that single precision suffices for georeferenced meshes.
    RayCaster(const TriangleMesh &mesh, const glm::dvec3 &centre);
    ~RayCaster();
    RayCaster(const RayCaster &) = delete;
    RayCaster &operator=(const RayCaster &) = delete;

    // Model space; `direction` of any length.
    std::optional<RayHit> nearest(const glm::dvec3 &origin, const glm::dvec3 &direction) const;
    // Whether a triangle lies between `origin` and `origin + reach * direction`.
    bool is_blocked(const glm::dvec3 &origin, const glm::dvec3 &direction, double reach) const;

    // One ray through each pixel's centre.
    RayImage cast(const Camera &camera, int width, int height, int threads) const;

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
    glm::dvec3 centre_;
};

} // namespace pbm
