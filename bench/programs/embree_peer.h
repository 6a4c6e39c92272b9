// Primary rays and Lambert's law with Embree, in a file of its own because of its headers.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_scan/surface/surface.h"

#include <memory>

namespace pbm::bench {

class EmbreePeer {
  public:
    // Builds the hierarchy with all processors; renders with `threads` threads. Embree's highest build quality and
    // packets of 8 rays are no faster here.
    // `centre` is subtracted from every position, so that single precision suffices for georeferenced meshes.
    //
    // throws  std::runtime_error  no memory
    EmbreePeer(const build::Surface &mesh, const glm::dvec3 &centre, int threads);
    ~EmbreePeer();
    EmbreePeer(const EmbreePeer &) = delete;
    EmbreePeer &operator=(const EmbreePeer &) = delete;

    // One ray through each pixel's centre, in packets of 4 x 4. All triangles have the same grey, lit from the eye by
    // their geometric normal. Writes colour and depth.
    void render(const Camera &camera, Framebuffer &target);

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

} // namespace pbm::bench
