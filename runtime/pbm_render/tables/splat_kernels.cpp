#include "pbm_render/tables/splat_kernels.h"

#include "pbm_format/model/normal.h"
#include "pbm_render/camera/normal_table.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr std::size_t kDigits = 64;
constexpr int kFineBits = 4;         // of a normal's index below its three coarse digits
constexpr double kRadius = 8;        // of the disc in a kernel, pixels
constexpr double kMinCosine = 0.125; // minimum cosine at which a disc is drawn, so that none vanishes

// Mean direction of the first octant's normals with these coarse digits; z towards the eye.
glm::dvec3 mean_normal(std::size_t digits) {
    glm::dvec3 sum(0);
    for (std::size_t fine = 0; fine < 1U << kFineBits; ++fine) {
        const UnitVector &n = normal_table()[digits << kFineBits | fine];
        sum += glm::dvec3(n[0], n[1], n[2]);
    }
    return glm::normalize(sum);
}

// Rotates the normal towards the eye until its cosine with the ray is at least kMinCosine.
glm::dvec3 not_edge_on(const glm::dvec3 &normal, const glm::dvec3 &ray) {
    const glm::dvec3 to_eye = -glm::normalize(ray);
    const double cosine = glm::dot(normal, to_eye);
    if (cosine >= kMinCosine)
        return normal;
    const glm::dvec3 across = glm::normalize(normal - cosine * to_eye);
    return kMinCosine * to_eye + std::sqrt(1 - kMinCosine * kMinCosine) * across;
}

// The image of a disc at `depth` whose centre projects to `pixel`, relative to the screen's middle. Eye space: x to the
// right, y down, z along the view direction.
SplatKernel project_disc(glm::dvec3 normal, glm::dvec2 pixel, double depth, double focal) {
    const glm::dvec3 ray(pixel / focal, 1);
    const glm::dvec3 centre = ray * depth;
    const double radius = kRadius * depth / focal;
    normal = not_edge_on(normal, ray);
    SplatKernel kernel{};
    for (int y = 0; y < kKernelEdge; ++y)
        for (int x = 0; x < kKernelEdge; ++x) {
            const glm::dvec2 offset(x + 0.5 - kRadius, y + 0.5 - kRadius);
            const glm::dvec3 through((pixel + offset) / focal, 1);
            const double along = glm::dot(normal, through);
            if (along >= 0) // the ray misses the disc's front
                continue;
            const glm::dvec3 hit = through * (glm::dot(normal, centre) / along);
            if (glm::length(hit - centre) <= radius)
                kernel[static_cast<std::size_t>(y)] |= static_cast<std::uint16_t>(1U << x);
        }
    return kernel;
}

} // namespace

SplatKernels::SplatKernels(const Projection &projection, int width, int height, double front, double rear)
    : middle_(projection.middle), front_(static_cast<float>(front)),
      inverse_range_(static_cast<float>(1 / (rear - front))) {
    normals_.reserve(kNormalCount);
    for (const UnitVector &n : normal_table()) {
        const glm::dvec3 normal(n[0], n[1], n[2]);
        const double right = glm::dot(projection.axes.right, normal), down = -glm::dot(projection.axes.up, normal);
        const double near = std::abs(glm::dot(projection.axes.forward, normal));
        const auto digits = quantise_normal(std::abs(right), std::abs(down), near) >> kFineBits & (kDigits - 1);
        normals_.push_back({static_cast<std::uint8_t>(digits), right < 0, down < 0});
    }
    if (projection.has_round_points)
        append_facing(normals_,
                      {static_cast<std::uint8_t>(quantise_normal(0, 0, 1) >> kFineBits & (kDigits - 1)), false, false});
    kernels_.reserve(kKernelCount);
    for (std::size_t index = 0; index < kKernelCount; ++index) {
        const glm::dvec3 normal = mean_normal(index % kDigits);
        const glm::dvec2 pixel((index >> 8 & 1 ? 0.375 : 0.125) * width, (index >> 9 & 1 ? 0.375 : 0.125) * height);
        const double depth = front + (static_cast<double>(index >> 6 & 3) + 0.5) / 4 * (rear - front);
        kernels_.push_back(project_disc({normal.x, normal.y, -normal.z}, pixel, depth, projection.focal));
    }
}

std::size_t SplatKernels::index_of(NormalBits normal, glm::vec2 pixel, float depth) const {
    const std::size_t outer_x = std::abs(pixel.x - middle_.x) >= middle_.x / 2;
    const std::size_t outer_y = std::abs(pixel.y - middle_.y) >= middle_.y / 2;
    const auto quarter = static_cast<std::size_t>(std::clamp((depth - front_) * inverse_range_ * 4, 0.0F, 3.0F));
    return outer_y << 9 | outer_x << 8 | quarter << 6 | normal.digits;
}

void SplatKernels::draw(std::size_t normal, glm::vec2 pixel, float depth, float radius, std::uint32_t index,
                        Framebuffer &target) const {
    static constexpr SplatKernel kAll = [] {
        SplatKernel all{};
        all.fill(0xFFFF);
        return all;
    }();
    const NormalBits bits = normals_[normal];
    const SplatKernel &kernel = radius <= 3 ? kAll : kernels_[index_of(bits, pixel, depth)];
    int scale = 1, edge = kKernelEdge; // pixels per kernel pixel; pixels of the splat's edge
    if (radius <= 3)
        edge = radius <= 1 ? 1 : 3;
    else
        for (; static_cast<float>(scale) * static_cast<float>(kRadius) < radius && edge < kMaxPictureEdge; scale *= 2)
            edge = 2 * scale * kKernelEdge;
    const glm::vec2 corner = glm::round(pixel - static_cast<float>(edge) / 2);
    // Clamp to integers; positions this far outside are clipped anyway.
    const auto place = [](float at) { return static_cast<int>(std::clamp(at, -1e6F, 1e6F)); };
    const int left = place(corner.x), top = place(corner.y);
    for (int y = std::max(top, 0); y < std::min(top + edge, target.height); ++y) {
        const int row = (y - top) / scale;
        const unsigned stencil = kernel[static_cast<std::size_t>(bits.up ? kKernelEdge - 1 - row : row)];
        for (int x = std::max(left, 0); x < std::min(left + edge, target.width); ++x) {
            const int column = (x - left) / scale;
            if ((stencil >> (bits.left ? kKernelEdge - 1 - column : column) & 1) == 0)
                continue;
            const auto at = static_cast<std::size_t>(std::ptrdiff_t{y} * target.width + x);
            if (depth < target.depth[at]) {
                target.depth[at] = depth;
                target.colour[at] = index;
            }
        }
    }
}

} // namespace pbm
