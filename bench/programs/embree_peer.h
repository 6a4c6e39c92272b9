// Primary rays and Lambert's law with Embree, kept apart because of its headers.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_scan/surface/surface.h"

#include <memory>

namespace pbm::bench {

class EmbreePeer {
  public:
    // Builds the hierarchy with all processors; pictures are made with `threads` of them. Embree's highest quality is
    // no faster here, nor are packets of 8 rays.
    // `centre` is subtracted from every position, so that single precision suffices for georeferenced meshes.
    //
    // throws  std::runtime_error  no memory
    EmbreePeer(const build::Surface &mesh, const glm::dvec3 &centre, int threads);
    ~EmbreePeer();
    EmbreePeer(const EmbreePeer &) = delete;
    EmbreePeer &operator=(const EmbreePeer &) = delete;

    // One ray through each pixel's centre in packets of 4 x 4, all triangles of one grey, lit from the eye by their
    // geometric normal; colour and depth are written.
    void render(const Camera &camera, Framebuffer &target);

  private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

} // namespace pbm::bench
