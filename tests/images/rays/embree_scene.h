// A mesh as an Embree scene. Only for files that include Embree's headers anyway.
#pragma once

#include <embree3/rtcore.h>
#include <glm/vec3.hpp>

#include <span>

namespace pbm {

struct EmbreeScene {
    // `centre` is subtracted from every position, so that single precision suffices for georeferenced meshes. Builds
    // the hierarchy with all processors.
    //
    // throws  std::runtime_error  no memory
    EmbreeScene(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles, const glm::dvec3 &centre,
                RTCSceneFlags flags);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene &) = delete;
    EmbreeScene &operator=(const EmbreeScene &) = delete;

    RTCDevice device;
    RTCScene scene;
};

} // namespace pbm
