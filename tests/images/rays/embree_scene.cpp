#include "embree_scene.h"

#include <stdexcept>

namespace pbm {

EmbreeScene::EmbreeScene(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
                         const glm::dvec3 &centre, RTCSceneFlags flags)
    : device(rtcNewDevice(nullptr)), scene(rtcNewScene(device)) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto *const vertices = static_cast<float *>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), positions.size()));
    auto *const corners = static_cast<unsigned *>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles.size()));
    if (vertices == nullptr || corners == nullptr)
        throw std::runtime_error("Embree: no memory for the mesh");
    for (std::size_t i = 0; i < positions.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            vertices[3 * i + static_cast<std::size_t>(axis)] = static_cast<float>(positions[i][axis] - centre[axis]);
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (int corner = 0; corner < 3; ++corner)
            corners[3 * i + static_cast<std::size_t>(corner)] = triangles[i][corner];
    rtcSetSceneFlags(scene, flags);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
}

EmbreeScene::~EmbreeScene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
}

} // namespace pbm
