#include "pbm_build/panorama/default_panorama.h"

#include "pbm_build/texture/noise.h"
#include "pbm_format/model/point_values.h"
#include "system/threads/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace pbm::build {
namespace {

constexpr double kPi = 3.14159265358979323846;

struct SineCosine {
    double sine, cosine;
};

// Taylor polynomials, accurate to 1e-11 up to pi / 4. Not libm, whose last bits differ between machines.
SineCosine small_sine_cosine(double angle) {
    const double s = angle * angle;
    return {.sine = angle * (1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72 * (1 - s / 110))))),
            .cosine = 1 - s / 2 * (1 - s / 12 * (1 - s / 30 * (1 - s / 56 * (1 - s / 90 * (1 - s / 132)))))};
}

SineCosine sine_cosine(double angle) {
    const double quarters = std::floor(angle / (kPi / 2) + 0.5);
    const SineCosine small = small_sine_cosine(angle - quarters * (kPi / 2));
    switch (static_cast<int>(quarters) & 3) {
    case 0: return small;
    case 1: return {.sine = small.cosine, .cosine = -small.sine};
    case 2: return {.sine = -small.sine, .cosine = -small.cosine};
    default: return {.sine = -small.cosine, .cosine = small.sine};
    }
}

glm::vec3 blend(float t, const glm::vec3 &a, const glm::vec3 &b) { return a + t * (b - a); }

float power_of_two_power(float base, int doublings) { // base^(2^doublings)
    for (; doublings > 0; --doublings)
        base *= base;
    return base;
}

// Linear colours.
constexpr glm::vec3 kZenith{0.22F, 0.32F, 0.48F};
constexpr glm::vec3 kSkyMiddle{0.42F, 0.54F, 0.70F};
constexpr glm::vec3 kHorizon{0.83F, 0.83F, 0.81F};
constexpr glm::vec3 kSunlight{1.0F, 0.93F, 0.80F};
constexpr glm::vec3 kCloudShade{0.50F, 0.53F, 0.58F};
constexpr glm::vec3 kCloudLight{0.98F, 0.96F, 0.93F};
constexpr glm::vec3 kFarHill{0.44F, 0.49F, 0.54F};
constexpr glm::vec3 kNearHill{0.19F, 0.22F, 0.20F};
constexpr glm::vec3 kHaze{0.62F, 0.64F, 0.66F};
constexpr glm::vec3 kGround{0.40F, 0.37F, 0.33F};

// Towards the sun: x right, y up, z behind the default camera.
constexpr glm::vec3 kSun{-0.5121F, 0.5487F, 0.6609F};

class Painter {
  public:
    explicit Painter(std::uint32_t width) : width_(width), columns_(width) {
        for (std::uint32_t column = 0; column < width; ++column) {
            const auto [sine, cosine] = sine_cosine((column + 0.5) / width * 2 * kPi - kPi);
            columns_[column] = {static_cast<float>(sine), 0, static_cast<float>(-cosine)};
        }
    }

    void paint(std::uint32_t y, std::uint8_t *texels) const {
        const auto [sine, cosine] = sine_cosine(kPi / 2 - (y + 0.5) / width_ * 2 * kPi);
        const auto height = static_cast<float>(sine), reach = static_cast<float>(cosine);
        std::vector<glm::vec3> colours(width_);
        if (height > 0)
            paint_sky(height, reach, colours);
        else
            paint_ground(height, reach, colours);
        if (std::abs(height) < 0.2F)
            paint_hills(height, colours);
        for (std::uint32_t column = 0; column < width_; ++column)
            for (int channel = 0; channel < 3; ++channel) {
                const float linear = std::clamp(colours[column][channel], 0.0F, 1.0F);
                *texels++ = linear_to_srgb(static_cast<std::uint32_t>(linear * 65535 + 0.5F));
            }
    }

  private:
    // Direction of column i in a row.
    glm::vec3 direction(std::size_t i, float reach, float height) const {
        return columns_[i] * reach + glm::vec3(0, height, 0);
    }

    // Sums of octaves at `place(i)` of each column i.
    template <class Place> std::vector<float> sums(const Octaves &octaves, const Place &place) const {
        std::vector<float> x(width_), y(width_), z(width_), result(width_);
        for (std::size_t i = 0; i < width_; ++i) {
            const glm::vec3 at = place(i);
            x[i] = at.x;
            y[i] = at.y;
            z[i] = at.z;
        }
        sum_octaves(noise_, octaves, {x, y, z}, result);
        return result;
    }
    std::vector<float> sums(const Octaves &octaves, float reach, float height, float shift) const {
        return sums(octaves, [&](std::size_t i) { return direction(i, reach, height) + shift; });
    }

    // Clouds lie on a spherical shell, so they become denser towards the horizon.
    void paint_sky(float height, float reach, std::vector<glm::vec3> &colours) const {
        const float distance = 1 / (height + 0.14F);
        const double texel = 2 * kPi / width_;
        const auto cells = [&](double frequency) { return 1 / (texel * frequency * static_cast<double>(distance)); };
        constexpr float kFrequency = 1.15F;
        const float far = distance * kFrequency;
        const auto shape = sums(band_limited_octaves(cells(kFrequency), 9), reach * far, height * far, 11.3F);
        // The same noise shifted towards the sun: the difference lights the side of a cloud.
        const auto lit = sums(band_limited_octaves(cells(kFrequency), 6),
                              [&](std::size_t i) { return direction(i, reach, height) * far + 11.3F + 0.16F * kSun; });
        const auto veil = sums(band_limited_octaves(cells(0.65), 8), reach * far * 0.4F, height * far * 1.6F, 47.9F);

        const float low = smooth_step(0, 0.28F, height), high = smooth_step(0.15F, 1.0F, height);
        const glm::vec3 clear = blend(high, blend(low, kHorizon, kSkyMiddle), kZenith);
        const float fades = smooth_step(0.0F, 0.16F, height); // into the haze of the horizon
        for (std::size_t i = 0; i < width_; ++i) {
            const float sun = std::max(0.0F, glm::dot(direction(i, reach, height), kSun));
            const float glow = 0.35F * power_of_two_power(sun, 3) + 0.5F * power_of_two_power(sun, 6) +
                               0.5F * power_of_two_power(sun, 9);
            glm::vec3 colour = clear + 0.5F * glow * kSunlight;
            const float thin = 0.35F * smooth_step(-0.2F, 0.7F, veil[i]) * fades;
            colour = blend(thin, colour, kCloudLight);
            const float thick = smooth_step(0.02F, 0.48F, shape[i] + 0.05F) * fades;
            const float light =
                std::clamp(0.62F + 0.9F * (shape[i] - lit[i]) - 0.25F * shape[i] + 0.6F * glow, 0.0F, 1.0F);
            colour = blend(0.9F * thick, colour, blend(light, kCloudShade, kCloudLight));
            const float disc = power_of_two_power(sun, 12) * (1 - 0.5F * thick);
            colours[i] = colour + (2.5F * disc) * kSunlight;
        }
    }

    // A terrace of stone slabs; the unit is the height of the eye.
    void paint_ground(float height, float reach, std::vector<glm::vec3> &colours) const {
        constexpr float kSlab = 0.6F, kJoint = 0.03F;
        const float distance = 1 / std::max(0.004F, -height);
        // A texel is longer at a low angle.
        const float texel = static_cast<float>(2 * kPi / width_) * distance * std::max(1.0F, 0.6F * distance);
        const auto octaves = [&](double frequency, int most, float gain) {
            return band_limited_octaves(1 / (frequency * static_cast<double>(texel)), most, gain);
        };
        const auto grain = sums(octaves(9, 8, 0.75F), reach * distance * 9, 0, 5.1F);
        const auto patches = sums(octaves(0.7, 7, 0.5F), reach * distance * 0.7F, 0, 33.7F);
        const auto slab_of = [&](std::size_t i) { return columns_[i] * reach * distance / kSlab + 0.5F; };
        const auto tone = sums({.count = 1, .amplitudes = {1}}, [&](std::size_t i) {
            return glm::floor(slab_of(i)) * glm::vec3(0.47F, 0, 0.47F) + glm::vec3(0.2F, 0.4F, 0.3F);
        });
        const float haze = smooth_step(0.09F, 0.0F, -height);
        const float distinct = smooth_step(1.2F * kSlab, 0.2F * kSlab, texel);
        for (std::size_t i = 0; i < width_; ++i) {
            const glm::vec3 in_slab = glm::fract(slab_of(i));
            const float joint =
                std::max(joint_cover(in_slab.x, kJoint, texel / kSlab), joint_cover(in_slab.z, kJoint, texel / kSlab));
            const float stone = 1 + 0.10F * grain[i] + 0.20F * patches[i] + 0.30F * distinct * tone[i];
            const float sunny = 0.90F + 0.10F * glm::dot(columns_[i], kSun);
            colours[i] = blend(0.8F * haze, (1 - 0.55F * joint) * stone * sunny * kGround, kHaze);
        }
    }

    // Share of a texel that is covered by a joint between slabs; `at`: position within the slab, 0..1.
    static float joint_cover(float at, float joint, float texel) {
        const float from_joint = std::min(at, 1 - at);
        const float inside = std::clamp((joint / 2 + texel / 2 - from_joint) / texel, 0.0F, 1.0F);
        return inside * std::min(1.0F, joint / texel);
    }

    // Two ranges of hills; their outlines are noise on a circle, so they are periodic.
    void paint_hills(float height, std::vector<glm::vec3> &colours) const {
        const float texel = static_cast<float>(2 * kPi / width_);
        const auto range = [&](float frequency, float shift, float base, float relief, glm::vec3 tint, float haze) {
            const double texels = 1 / (2 * kPi / width_ * static_cast<double>(frequency));
            const auto outline = sums(band_limited_octaves(texels, 9), frequency, 0, shift);
            for (std::size_t i = 0; i < width_; ++i) {
                const float top = base + relief * (outline[i] + 0.3F);
                const float inside = std::clamp((top - height) / texel + 0.5F, 0.0F, 1.0F) *
                                     std::clamp(height / texel + 0.5F, 0.0F, 1.0F);
                const float foot = haze * smooth_step(top, 0, height);
                colours[i] = blend(inside, colours[i], blend(foot, tint, kHorizon));
            }
        };
        range(1.7F, 61.1F, 0.045F, 0.055F, kFarHill, 0.5F);
        range(3.1F, 83.3F, 0.012F, 0.030F, kNearHill, 0.35F);
    }

    std::uint32_t width_;
    std::vector<glm::vec3> columns_; // horizontal unit vectors
    PerlinNoise noise_{18};
};

} // namespace

Image default_panorama(std::uint32_t width, int threads) {
    assert(width >= 16 && width <= 16384 && (width & (width - 1)) == 0);
    Image image{
        .width = width, .height = width / 2, .channels = 3, .texels = Bytes(std::size_t{width} * (width / 2) * 3)};
    const Painter painter(width);
    parallel_for(image.height, threads, [&](std::size_t y) {
        painter.paint(static_cast<std::uint32_t>(y), image.texels.data() + y * width * 3);
    });
    return image;
}

} // namespace pbm::build
