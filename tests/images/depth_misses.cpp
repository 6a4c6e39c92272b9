#include "depth_misses.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace pbm {
namespace {

constexpr float kGrazing = 0.2588F; // cosine of 75 degrees
constexpr float kContour = 4;       // voxels
constexpr double kThin = 2;         // voxels
constexpr float kSmooth = 0.866F;   // cosine of 30 degrees
constexpr double kBehindHit = 1e-3; // voxels: a ray continues so far behind a triangle

bool leaves_soon(const RayCaster &rays, const glm::dvec3 &hit, const glm::dvec3 &direction, double voxel) {
    const glm::dvec3 step = glm::normalize(direction) * voxel;
    const auto next = rays.nearest(hit + step * kBehindHit, step);
    return next && static_cast<double>(next->distance) < kThin && glm::dot(glm::dvec3(next->face), step) > 0;
}

// Whether the mesh bends strongly within half a voxel of a hit.
bool is_rough(const RayCaster &rays, const glm::dvec3 &hit, const glm::vec3 &face, double voxel) {
    const glm::dvec3 normal(face), other = std::abs(face.x) < 0.7F ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 across = glm::normalize(glm::cross(normal, other)), along = glm::cross(normal, across);
    for (const auto &[u, v] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
        const glm::dvec3 from = hit + (across * (0.35 * u) + along * (0.35 * v) + normal) * voxel;
        const auto beside = rays.nearest(from, -normal * voxel);
        if (!beside || beside->distance > 2 || glm::dot(beside->face, face) < kSmooth)
            return true;
    }
    return false;
}

} // namespace

void add_depth_misses(const RayCaster &rays, const Camera &camera, const PictureTruth &truth,
                      const DrawnPicture &drawing, DepthMisses &to) {
    const Framebuffer &drawn = drawing.picture;
    const PixelRays pixels(camera, drawn.width, drawn.height);
    const RayImage &image = truth.rays;
    const auto width = static_cast<std::size_t>(drawn.width);
    for (std::size_t at = 0; at < drawn.pixels(); ++at) {
        if (!truth.is_interior(at))
            continue;
        ++to.pixels;
        const float depth = drawn.depth[at], ray = image.depths[at], voxel = drawing.voxels[at];
        to.within_two += std::abs(depth - ray) <= 2 * voxel;
        if (std::abs(depth - ray) <= voxel)
            continue;
        if (image.cosines[at] < kGrazing) {
            ++to.grazing;
            continue;
        }
        float nearest = ray, farthest = ray;
        for (std::size_t row = 0; row < 5; ++row) // interior: the neighbours are in the picture
            for (std::size_t column = 0; column < 5; ++column) {
                const float next = truth.outside[at + row * width + column - 2 * width - 2];
                nearest = std::min(nearest, next);
                farthest = std::max(farthest, next);
            }
        if (farthest - nearest > kContour * voxel && depth >= nearest - voxel && depth <= farthest + voxel) {
            ++to.contours;
            to.outgrown += depth < ray;
            continue;
        }
        const std::size_t line = at / width;
        const glm::dvec3 direction =
            pixels.through(static_cast<double>(at % width) + 0.5, static_cast<double>(line) + 0.5);
        const auto hit = rays.nearest(pixels.eye, direction);
        const glm::dvec3 place = pixels.eye + direction * static_cast<double>(ray);
        const auto edge = static_cast<double>(voxel);
        if (leaves_soon(rays, place, direction, edge))
            ++to.thin;
        else if (hit && is_rough(rays, place, hit->face, edge))
            ++to.relief;
        else
            ++to.others;
    }
}

std::string to_text(const DepthMisses &misses) {
    std::array<char, 400> text{};
    const auto share = [&](std::uint64_t part) { return percent(part, misses.pixels); };
    std::snprintf(text.data(), text.size(),
                  "within 1 voxel %.3f %%, within 2 voxels %.3f %%; missed: grazing %.3f %%, contours %.3f %% (%.3f %% "
                  "in front), thin "
                  "walls %.3f %%, relief %.3f %%, others %.3f %%\n",
                  100 - share(misses.all()), share(misses.within_two), share(misses.grazing), share(misses.contours),
                  share(misses.outgrown), share(misses.thin), share(misses.relief), share(misses.others));
    return text.data();
}

} // namespace pbm
