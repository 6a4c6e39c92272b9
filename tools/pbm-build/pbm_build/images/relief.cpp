#include "pbm_build/images/relief.h"

#include "pbm_build/images/texture_pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace pbm::build {
namespace {

// Numbers of texels that triangles show, 0..255, and how many those are. Exact as far as floats are: bytes that are
// rounded from level to level would hide a gentle relief.
struct TexelSum {
    std::array<float, 3> numbers{};
    float count = 0;
};

struct TexelSums {
    std::uint32_t width = 0, height = 0;
    std::vector<TexelSum> at; // [height][width]
};

// The mean squared length of the means of the squares.
template <class At> double mean_square(std::uint32_t width, std::uint32_t height, double scale, const At &at) {
    double sum = 0, counts = 0;
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
        const TexelSum texels = at(i);
        if (!(texels.count > 0))
            continue;
        const auto count = static_cast<double>(texels.count);
        const auto part = [&](std::size_t c) { return static_cast<double>(texels.numbers[c]) / count / 127.5 - 1; };
        counts += count;
        sum += count * (scale * scale * (part(0) * part(0) + part(1) * part(1)) + part(2) * part(2));
    }
    return counts > 0 ? sum / counts : 0;
}

template <class At> TexelSums halved(std::uint32_t width, std::uint32_t height, const At &at) {
    TexelSums half{(width + 1) / 2, (height + 1) / 2, {}};
    half.at.resize(std::size_t{half.width} * half.height);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const TexelSum from = at(y * width + x);
            TexelSum &to = half.at[y / 2 * half.width + x / 2];
            to.count += from.count;
            for (std::size_t c = 0; c < 3; ++c)
                to.numbers[c] += from.numbers[c];
        }
    return half;
}

// What is lost of the mean square is the variance v within the squares. A normal that changes evenly by d along both
// axes has v = d^2 / 6.
Relief relief_of(const Texture &image, const TextureCoverage &coverage) {
    const auto scale = static_cast<double>(image.use.relief);
    const auto texel = [&](std::size_t i) {
        const auto &numbers = image.texels[i];
        return coverage.covers(i) ? TexelSum{{static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
                                              static_cast<float>(numbers[2])},
                                             1}
                                  : TexelSum{};
    };
    const double whole = mean_square(image.width, image.height, scale, texel);
    Relief relief{0};
    TexelSums level = halved(image.width, image.height, texel);
    while (true) {
        const auto sum = [&level](std::size_t i) { return level.at[i]; };
        const double lost = whole > 0 ? 1 - mean_square(level.width, level.height, scale, sum) / whole : 0;
        relief.push_back(std::max(6 * lost, relief.back()));
        if (level.width <= 1 && level.height <= 1)
            return relief;
        level = halved(level.width, level.height, sum);
    }
}

} // namespace

std::vector<Relief> measure_relief(const Surface &surface, int threads) {
    if (surface.layer(Layer::normals).ids.empty())
        return {};
    const std::vector<TextureCoverage> coverages = covered_texels(surface, threads);
    std::vector<Relief> reliefs(surface.textures.size());
    for (std::size_t i = 0; i < reliefs.size(); ++i)
        if (const Texture &image = surface.textures[i]; image.use.content == ImageContent::normals)
            reliefs[i] = relief_of(image, coverages[i]);
    return reliefs;
}

double squared_change(const Relief &relief, double edge) {
    if (relief.size() < 2 || !(edge > 0))
        return 0;
    if (edge <= 2) // the normal changes evenly
        return relief[1] * edge * edge / 4;
    const double level = std::min(std::log2(edge), static_cast<double>(relief.size() - 1));
    const auto below = std::min(static_cast<std::size_t>(level), relief.size() - 2);
    const double part = level - static_cast<double>(below);
    return relief[below] * (1 - part) + relief[below + 1] * part;
}

} // namespace pbm::build
