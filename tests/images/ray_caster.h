// What a picture should show: one ray per pixel against the triangles.
#pragma once

#include "pbm_render/camera.h"
#include "triangle_mesh.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace pbm {

// [height][width], top row first.
struct RayImage {
    std::vector<float> depths;        // of the nearest triangle along the view direction, +infinity where there is none
    std::vector<std::uint8_t> inside; // 1: the ray meets the triangle's back, so the mesh is open there
};

class RayCaster {
  public:
    // `centre` is subtracted from every position, so that single precision suffices for georeferenced meshes.
    RayCaster(const TriangleMesh &mesh, const glm::dvec3 &centre);
    ~RayCaster();
    RayCaster(const RayCaster &) = delete;
    RayCaster &operator=(const RayCaster &) = delete;

    // One ray through each pixel's centre.
    RayImage cast(const Camera &camera, int width, int height, int threads) const;

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
    glm::dvec3 centre_;
};

} // namespace pbm
