#include "pbm_build/images/triangle_texture.h"

#include "pbm_format/model/point_values.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

std::int64_t floor_of(double value) {
    constexpr double kMost = 1e15;
    return static_cast<std::int64_t>(std::floor(std::clamp(value, -kMost, kMost)));
}

double area(const glm::dvec2 &a, const glm::dvec2 &b) { return std::abs(a.x * b.y - a.y * b.x) / 2; }

} // namespace

void TriangleTexture::set(const TexturePyramid &pyramid, const TextureCorners &texture,
                          const std::array<glm::dvec3, 3> &corners) {
    pyramid_ = &pyramid;
    const auto &levels = pyramid.levels();
    const auto place = [&](std::size_t corner, const TexturePyramid::Level &level) {
        return glm::dvec2(texture[corner]) * glm::dvec2(level.width, level.height);
    };
    const glm::dvec3 ab = corners[1] - corners[0], ac = corners[2] - corners[0];
    const glm::dvec3 normal = glm::cross(ab, ac);
    const double twice_area = glm::length(normal);
    const glm::dvec2 first = place(0, levels[0]);
    const double texels = area(place(1, levels[0]) - first, place(2, levels[0]) - first);
    // Texels of the image over a square voxel; a triangle without area has none.
    const double over_voxel = twice_area > 0 ? texels / (twice_area / 2) : 0;
    is_magnified_ = over_voxel <= 1;
    // Four texels of the level are about one voxel.
    std::size_t number = 0;
    for (double left = over_voxel / 4; left > 2 && number + 1 < levels.size(); left /= 4)
        ++number;
    level_ = &levels[number];
    for (std::size_t i = 0; i < 3; ++i)
        corners_[i] = place(i, *level_);

    steps_ = {};
    if (is_magnified_ || !(twice_area > 0))
        return;
    // A step s in the plane changes the weights by the gradients of barycentric coordinates.
    const glm::dvec3 along = ab / glm::length(ab), across = glm::cross(normal / twice_area, along);
    const glm::dvec3 of_b = glm::cross(ac, normal) / (twice_area * twice_area),
                     of_c = glm::cross(normal, ab) / (twice_area * twice_area);
    constexpr double kQuarter = 0.25;
    for (std::size_t i = 0; i < 2; ++i) {
        const glm::dvec3 step = (i == 0 ? along : across) * kQuarter;
        const double b = glm::dot(step, of_b), c = glm::dot(step, of_c);
        steps_[i] = {-b - c, b, c};
    }
}

std::array<std::int32_t, 3> TriangleTexture::interpolated(const glm::dvec2 &at) const {
    const double x = at.x - 0.5, y = at.y - 0.5;
    const std::int64_t left = floor_of(x), top = floor_of(y);
    const double right = x - static_cast<double>(left), bottom = y - static_cast<double>(top);
    std::array<double, 3> sums{};
    double weights = 0;
    for (int i = 0; i < 4; ++i) {
        const TexturePyramid::Texel &texel = level_->at(left + (i & 1), top + (i >> 1), pyramid_->wrap());
        // Texels of the background count only where there is nothing else.
        const double share = texel[3] != 0 ? 1 : 1e-6;
        const double weight = ((i & 1) != 0 ? right : 1 - right) * ((i >> 1) != 0 ? bottom : 1 - bottom) * share;
        weights += weight;
        for (std::size_t c = 0; c < 3; ++c)
            sums[c] += weight * linear_table()[texel[c]];
    }
    std::array<std::int32_t, 3> colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<std::int32_t>(sums[c] / weights + 0.5);
    return colour;
}

std::array<std::int32_t, 3> TriangleTexture::colour(const std::array<double, 3> &weights) const {
    if (is_magnified_)
        return interpolated(weights[0] * corners_[0] + weights[1] * corners_[1] + weights[2] * corners_[2]);
    std::array<std::uint64_t, 3> sums{};
    std::uint64_t all = 0;
    for (int i = 0; i < 4; ++i) {
        const double first = (i & 1) != 0 ? 1 : -1, second = (i >> 1) != 0 ? 1 : -1;
        std::array<double, 3> w{};
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            w[k] = std::max(0.0, weights[k] + first * steps_[0][k] + second * steps_[1][k]);
            sum += w[k];
        }
        const glm::dvec2 at = (w[0] * corners_[0] + w[1] * corners_[1] + w[2] * corners_[2]) / sum;
        const TexturePyramid::Texel &texel = level_->at(floor_of(at.x), floor_of(at.y), pyramid_->wrap());
        const std::uint64_t weight = std::uint64_t{texel[3]} * 256 + 1;
        all += weight;
        for (std::size_t c = 0; c < 3; ++c)
            sums[c] += weight * linear_table()[texel[c]];
    }
    std::array<std::int32_t, 3> colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<std::int32_t>((sums[c] + all / 2) / all);
    return colour;
}

} // namespace pbm::build
