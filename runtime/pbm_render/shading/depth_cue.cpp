#include "pbm_render/shading/depth_cue.h"

#include "pbm_render/appearance/shade_table.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace pbm {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();
constexpr int kBandRows = 16; // rows per work item

// Depths, clamped to the border outside the picture.
class Depths {
  public:
    explicit Depths(const Framebuffer &target)
        : width_(target.width), height_(target.height), depth_(target.depth.data()) {}

    float at(int x, int y) const {
        const std::ptrdiff_t row = std::clamp(y, 0, height_ - 1);
        return depth_[row * width_ + std::clamp(x, 0, width_ - 1)];
    }

  private:
    int width_, height_;
    const float *depth_;
};

template <class Work> void for_each_row(const Framebuffer &target, ThreadPool &pool, const Work &work) {
    const auto bands = static_cast<std::size_t>((target.height + kBandRows - 1) / kBandRows);
    pool.run(bands, [&](std::size_t band, std::size_t) {
        const int first = static_cast<int>(band) * kBandRows;
        for (int y = first; y < std::min(first + kBandRows, target.height); ++y)
            work(y);
    });
}

std::uint32_t darken(const ColourTable &table, std::uint32_t colour, float factor) {
    return (table.pack_srgb(table.linear(colour) * factor) & 0x00FFFFFFU) | (colour & 0xFF000000U);
}

// Eye-dome lighting: sums how much nearer the neighbours on two rings of eight are, relative to the pixel's depth. The
// rings scale with the picture, so that its size does not change its look.
class EyeDome {
  public:
    EyeDome(const DepthCueView &view, const Framebuffer &target)
        : depths_(target), relief_(static_cast<float>(view.relief)) {
        const double scale = std::max(1.0, target.height / 720.0);
        for (std::size_t i = 0; i < kDirections; ++i) {
            const double angle = glm::two_pi<double>() * static_cast<double>(i) / kDirections;
            for (std::size_t ring = 0; ring < kRings; ++ring) {
                const double radius = scale * (ring == 0 ? 1.4 : 4.0);
                offsets_[ring * kDirections + i] = {static_cast<int>(std::lround(radius * std::cos(angle))),
                                                    static_cast<int>(std::lround(radius * std::sin(angle)))};
            }
        }
    }

    float factor(int x, int y) const {
        constexpr float kStrength = 150;
        const float depth = depths_.at(x, y);
        float sum = 0;
        for (const glm::ivec2 &offset : offsets_)
            sum += std::clamp(relief_ * (1 - depths_.at(x + offset.x, y + offset.y) / depth), 0.0F, kMaxStep);
        return std::exp(-kStrength / (kRings * kDirections) * sum);
    }

  private:
    static constexpr std::size_t kRings = 2, kDirections = 8;
    static constexpr float kMaxStep = 0.012F; // limits the darkening of a distant wall behind an edge

    Depths depths_;
    float relief_;
    std::array<glm::ivec2, kRings * kDirections> offsets_;
};

// Ambient occlusion: the share of the half space above a pixel's surface that is filled within some distance.
class Occlusion {
  public:
    Occlusion(const DepthCueView &view, const Framebuffer &target)
        : depths_(target), focal_(static_cast<float>(view.focal)), reach_(static_cast<float>(kReach * view.grid_edge)),
          max_pixels_(static_cast<float>(target.height) / 8), middle_x_(static_cast<float>(target.width) / 2),
          middle_y_(static_cast<float>(target.height) / 2) {
        for (std::size_t turn = 0; turn < kTurns; ++turn)
            for (std::size_t i = 0; i < kSamples; ++i) {
                const double part = (static_cast<double>(i) + 0.5) / kSamples;
                const double angle =
                    glm::two_pi<double>() * (7 * part + static_cast<double>(turn) / kTurns); // seven turns outwards
                offsets_[turn][i] = glm::vec2(std::cos(angle), std::sin(angle)) * static_cast<float>(part);
            }
    }

    // 0 (occluded)..1 (open). Noisy: neighbouring pixels sample other directions.
    float openness(int x, int y) const {
        const glm::vec3 here = place(x, y);
        const glm::vec3 normal = facing_normal(x, y, here);
        const float pixels = std::min(reach_ * focal_ / here.z, max_pixels_);
        const float reach = pixels * here.z / focal_;
        // A 4 x 4 pattern of all sixteen numbers.
        static constexpr std::array<std::uint8_t, kTurns> kPattern{0, 8,  2, 10, 12, 4, 14, 6,
                                                                   3, 11, 1, 9,  15, 7, 13, 5};
        const auto &offsets = offsets_[kPattern[static_cast<std::size_t>(y & 3) * 4 + static_cast<std::size_t>(x & 3)]];
        float sum = 0;
        for (const glm::vec2 &offset : offsets) {
            const int u = x + static_cast<int>(std::lround(offset.x * pixels)),
                      v = y + static_cast<int>(std::lround(offset.y * pixels));
            if (depths_.at(u, v) == kEmpty)
                continue;
            const glm::vec3 to = place(u, v) - here;
            const float square = glm::dot(to, to);
            const float fade = std::max(0.0F, 1 - square / (reach * reach)); // distant foreground does not occlude
            sum += fade * std::max(0.0F, glm::dot(to, normal) - kSlack * here.z / focal_) /
                   std::sqrt(square + 1e-6F * reach * reach);
        }
        return std::max(0.0F, 1 - kStrength * sum / kSamples);
    }

  private:
    static constexpr double kReach = 0.08; // of the grid's edge
    static constexpr std::size_t kSamples = 16, kTurns = 16;
    static constexpr float kStrength = 8.0F;
    static constexpr float kSlack = 1.0F; // pixels; steps between voxels do not count as corners

    // Eye space: x to the right, y down, z along the view direction.
    glm::vec3 place(int x, int y) const {
        const float depth = depths_.at(x, y);
        return {(static_cast<float>(x) + 0.5F - middle_x_) / focal_ * depth,
                (static_cast<float>(y) + 0.5F - middle_y_) / focal_ * depth, depth};
    }

    // Difference to that of the neighbours at (dx, dy) and (-dx, -dy) whose depth is closer: it does not cross an edge.
    glm::vec3 along(int x, int y, int dx, int dy, const glm::vec3 &here) const {
        const bool ahead =
            std::abs(depths_.at(x + dx, y + dy) - here.z) < std::abs(depths_.at(x - dx, y - dy) - here.z);
        const glm::vec3 other = ahead ? place(x + dx, y + dy) : place(x - dx, y - dy);
        const glm::vec3 step = ahead ? other - here : here - other;
        return std::isfinite(step.z) ? step : glm::vec3(static_cast<float>(dx), static_cast<float>(dy), 0);
    }

    glm::vec3 facing_normal(int x, int y, const glm::vec3 &here) const {
        constexpr int kStep = 4; // pixels: much larger than voxels
        const glm::vec3 normal = glm::cross(along(x, y, 0, kStep, here), along(x, y, kStep, 0, here));
        const float length = glm::length(normal);
        return length > 0 ? normal / length : glm::vec3(0, 0, -1);
    }

    Depths depths_;
    float focal_, reach_, max_pixels_, middle_x_, middle_y_;
    std::array<std::array<glm::vec2, kSamples>, kTurns> offsets_;
};

// Mean over those of the surrounding 4 x 4 pixels that lie on the same surface: one of each direction of the pattern.
float smooth(const std::vector<float> &values, const Framebuffer &target, float relief, int x, int y) {
    const auto index = [&](int u, int v) {
        return static_cast<std::size_t>(std::ptrdiff_t{std::clamp(v, 0, target.height - 1)} * target.width +
                                        std::clamp(u, 0, target.width - 1));
    };
    const float depth = target.depth[index(x, y)];
    constexpr float kSameSurface = 0.01F; // parts of the depth
    const float reach = kSameSurface / relief * depth;
    float sum = 0, weight = 0;
    for (int v = y - 2; v < y + 2; ++v)
        for (int u = x - 2; u < x + 2; ++u)
            if (const std::size_t at = index(u, v); std::abs(target.depth[at] - depth) <= reach) {
                sum += values[at];
                ++weight;
            }
    return sum / weight;
}

// Darkens all drawn pixels by `factor(x, y)`.
template <class Factor> void darken_all(Framebuffer &target, ThreadPool &pool, const Factor &factor) {
    const ColourTable colours;
    for_each_row(target, pool, [&](int y) {
        const auto row = static_cast<std::size_t>(std::ptrdiff_t{y} * target.width);
        for (int x = 0; x < target.width; ++x)
            if (const std::size_t at = row + static_cast<std::size_t>(x); target.depth[at] != kEmpty)
                target.colour[at] = darken(colours, target.colour[at], factor(x, y));
    });
}

} // namespace

void apply_depth_cue(DepthCue cue, const DepthCueView &view, ThreadPool &pool, Framebuffer &target) {
    if (cue == DepthCue::eye_dome) {
        const EyeDome dome(view, target);
        darken_all(target, pool, [&](int x, int y) { return dome.factor(x, y); });
    } else if (cue == DepthCue::ambient_occlusion) {
        const Occlusion occlusion(view, target);
        std::vector<float> openness(target.pixels(), 1.0F);
        for_each_row(target, pool, [&](int y) {
            const auto row = static_cast<std::size_t>(std::ptrdiff_t{y} * target.width);
            for (int x = 0; x < target.width; ++x)
                if (const std::size_t at = row + static_cast<std::size_t>(x); target.depth[at] != kEmpty)
                    openness[at] = occlusion.openness(x, y);
        });
        const auto relief = static_cast<float>(view.relief);
        darken_all(target, pool, [&](int x, int y) { return smooth(openness, target, relief, x, y); });
    }
}

} // namespace pbm
