#include "embree_peer.h"

#include "embree_scene.h"
#include "pbm_format/model/point_values.h"
#include "system/threads/thread_pool.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pbm::bench {

namespace {

constexpr std::size_t kPacketEdge = 4, kRays = kPacketEdge * kPacketEdge;
constexpr int kShades = 1024;
constexpr double kAlbedo = 0.8; // linear

// [i]: sRGB of the reflected light if the cosine of normal and line of sight is i / (kShades - 1).
std::array<std::uint32_t, kShades> grey_shades() {
    std::array<std::uint32_t, kShades> shades{};
    for (std::size_t i = 0; i < shades.size(); ++i) {
        const double linear = kAlbedo * static_cast<double>(i) / (kShades - 1);
        const std::uint8_t grey = linear_to_srgb(static_cast<std::uint32_t>(std::lround(65535 * linear)));
        shades[i] = pack_rgba({grey, grey, grey, 255});
    }
    return shades;
}

// Ray directions with length 1 along the view direction, so that ray parameter = depth.
struct RayFrame {
    glm::vec3 eye;
    glm::vec3 corner, right, down; // direction to the centre of pixel (0, 0), steps per pixel
};

RayFrame ray_frame(const Camera &camera, const glm::dvec3 &centre, int width, int height) {
    const EyeAxes axes = eye_axes(camera);
    const double pixel = 2 * std::tan(camera.view_angle / 2) / height;
    return {camera.position - centre,
            axes.forward + axes.right * (pixel * (0.5 - width / 2.0)) - axes.up * (pixel * (0.5 - height / 2.0)),
            axes.right * pixel, -axes.up * pixel};
}

} // namespace

struct EmbreePeer::Scene {
    Scene(const build::Surface &mesh, const glm::dvec3 &origin, int threads)
        : triangles(mesh.positions, mesh.triangles, origin, RTC_SCENE_FLAG_NONE), centre(origin), pool(threads) {}
    void render_packet(const RayFrame &frame, std::size_t left, std::size_t top, Framebuffer &target) const;

    EmbreeScene triangles;
    glm::dvec3 centre;
    ThreadPool pool;
    std::array<std::uint32_t, kShades> shades = grey_shades();
};

EmbreePeer::EmbreePeer(const build::Surface &mesh, const glm::dvec3 &centre, int threads)
    : scene_(std::make_unique<Scene>(mesh, centre, threads)) {}

EmbreePeer::~EmbreePeer() = default;

void EmbreePeer::Scene::render_packet(const RayFrame &frame, std::size_t left, std::size_t top,
                                      Framebuffer &target) const {
    const auto width = static_cast<std::size_t>(target.width), height = static_cast<std::size_t>(target.height);
    alignas(64) std::array<int, kRays> valid;
    alignas(64) RTCRayHit16 rays;
    for (std::size_t i = 0; i < kRays; ++i) {
        const std::size_t x = left + i % kPacketEdge, y = top + i / kPacketEdge;
        valid[i] = x < width && y < height ? -1 : 0;
        const auto column = static_cast<float>(x), row = static_cast<float>(y);
        rays.ray.org_x[i] = frame.eye.x;
        rays.ray.org_y[i] = frame.eye.y;
        rays.ray.org_z[i] = frame.eye.z;
        rays.ray.dir_x[i] = frame.corner.x + column * frame.right.x + row * frame.down.x;
        rays.ray.dir_y[i] = frame.corner.y + column * frame.right.y + row * frame.down.y;
        rays.ray.dir_z[i] = frame.corner.z + column * frame.right.z + row * frame.down.z;
        rays.ray.tnear[i] = 0;
        rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
        rays.ray.time[i] = 0;
        rays.ray.mask[i] = ~0U;
        rays.ray.flags[i] = 0;
        rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid.data(), triangles.scene, &context, &rays);
    for (std::size_t i = 0; i < kRays; ++i) {
        const std::size_t x = left + i % kPacketEdge, y = top + i / kPacketEdge;
        if (valid[i] == 0 || rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID)
            continue;
        const glm::vec3 normal(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]);
        const glm::vec3 direction(rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]);
        const float cosine = std::abs(glm::dot(normal, direction)) /
                             std::sqrt(glm::dot(normal, normal) * glm::dot(direction, direction));
        const std::size_t at = y * width + x;
        target.colour[at] = shades[static_cast<std::size_t>(std::min(cosine, 1.0F) * (kShades - 1))];
        target.depth[at] = rays.ray.tfar[i];
    }
}

void EmbreePeer::render(const Camera &camera, Framebuffer &target) {
    const RayFrame frame = ray_frame(camera, scene_->centre, target.width, target.height);
    const auto width = static_cast<std::size_t>(target.width), height = static_cast<std::size_t>(target.height);
    target.clear({51, 51, 51, 255});
    scene_->pool.run((height + kPacketEdge - 1) / kPacketEdge, [&](std::size_t row, std::size_t) {
        for (std::size_t left = 0; left < width; left += kPacketEdge)
            scene_->render_packet(frame, left, row * kPacketEdge, target);
    });
}

} // namespace pbm::bench
