#include "pbm_build/images/triangle_texture.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

// Of places in an image, which are far from the limits of integers. std::floor is a call where SSE 4.1 may be missing.
std::int64_t floor_of(double value) {
    const auto towards_zero = static_cast<std::int64_t>(value);
    return towards_zero - (value < static_cast<double>(towards_zero) ? 1 : 0);
}

// What a texel of this share counts, shown and cut. Texels of the background count only where there is nothing else.
struct TexelWeights {
    std::array<double, 256> shown{}, cut{};

    explicit constexpr TexelWeights(bool is_faded) {
        for (std::size_t share = 1; share < shown.size(); ++share)
            shown[share] = cut[share] = is_faded ? static_cast<double>(share) / 255 : 1;
        constexpr double kHardly = 1e-6;
        shown[0] = kHardly;
    }
};
constexpr std::array<TexelWeights, 2> kTexelWeights{TexelWeights(false), TexelWeights(true)};

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

std::optional<std::array<std::int32_t, 3>> TriangleTexture::interpolated(const glm::dvec2 &at, double most_cut) const {
    const double x = at.x - 0.5, y = at.y - 0.5;
    const std::int64_t left = floor_of(x), top = floor_of(y);
    const double right = x - static_cast<double>(left), bottom = y - static_cast<double>(top);
    const std::uint16_t *const linear = pyramid_->table();
    const TexelWeights &counts = kTexelWeights[pyramid_->is_faded() ? 1 : 0];
    const std::array<double, 4> shares{(1 - right) * (1 - bottom), right * (1 - bottom), (1 - right) * bottom,
                                       right * bottom};
    std::array<double, 3> sums{};
    double weights = 0, cut = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const std::size_t index = level_->index(left + static_cast<std::int64_t>(i & 1),
                                                top + static_cast<std::int64_t>(i >> 1), pyramid_->wrap());
        const TexturePyramid::Texel &texel = level_->texels[index];
        const double weight = shares[i] * counts.shown[texel[3]];
        weights += weight;
        if (!level_->cut.empty())
            cut += shares[i] * counts.cut[level_->cut[index]];
        for (std::size_t c = 0; c < 3; ++c)
            sums[c] += weight * linear[texel[c]];
    }
    if (cut > most_cut * weights)
        return std::nullopt;
    const double share = 1 / weights;
    std::array<std::int32_t, 3> colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<std::int32_t>(sums[c] * share + 0.5);
    return colour;
}

glm::dvec2 TriangleTexture::place_of(const Weights &weights) const {
    return weights[0] * corners_[0] + weights[1] * corners_[1] + weights[2] * corners_[2];
}

std::optional<std::array<std::int32_t, 3>> TriangleTexture::colour(const Weights &weights, double opacity) const {
    const double most_cut = pyramid_->most_cut(opacity);
    const glm::dvec2 centre = place_of(weights);
    if (is_magnified_)
        return interpolated(centre, most_cut);
    // The places of all four at once, which compilers turn into vector instructions.
    constexpr std::array<double, kTaps> kFirst{-1, 1, -1, 1}, kSecond{-1, -1, 1, 1};
    std::array<double, kTaps> sum{}, x{}, y{};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < kTaps; ++i) {
            const double moved = weights[k] + kFirst[i] * steps_[0][k] + kSecond[i] * steps_[1][k];
            const double weight = moved > 0 ? moved : 0; // inside the triangle
            sum[i] += weight;
            x[i] += weight * corners_[k].x;
            y[i] += weight * corners_[k].y;
        }
    for (std::size_t i = 0; i < kTaps; ++i) {
        const double share = 1 / sum[i];
        x[i] *= share;
        y[i] *= share;
    }
    const std::uint16_t *const linear = pyramid_->table();
    std::array<std::uint32_t, 3> sums{};
    std::uint32_t all = 0, cut = 0;
    for (std::size_t i = 0; i < kTaps; ++i) {
        const std::size_t index = level_->index(floor_of(x[i]), floor_of(y[i]), pyramid_->wrap());
        const TexturePyramid::Texel &texel = level_->texels[index];
        if (!level_->cut.empty())
            cut += level_->cut[index];
        all += texel[3];
        for (std::size_t c = 0; c < 3; ++c)
            sums[c] += std::uint32_t{texel[3]} * linear[texel[c]];
    }
    if (cut > most_cut * all)
        return std::nullopt;
    if (all == 0) // by rounding, just outside of what is covered
        return interpolated(centre, most_cut);
    const double share = 1 / static_cast<double>(all);
    std::array<std::int32_t, 3> colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<std::int32_t>(static_cast<double>(sums[c]) * share + 0.5);
    return colour;
}

} // namespace pbm::build
