#include "pbm_scan/conventions/normal_maps.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace pbm::build {
namespace {

// JPEG images of heights have a trace of colour; the texels of a normal map differ by 100 and more.
bool is_grey(const Texture &image) {
    constexpr std::uint64_t kTrace = 16;
    std::uint64_t differences = 0;
    for (const auto &texel : image.texels)
        differences += static_cast<std::uint64_t>(std::max({texel[0], texel[1], texel[2]}) -
                                                  std::min({texel[0], texel[1], texel[2]}));
    return differences <= kTrace * image.texels.size();
}

// Heights, 0..255, of an image that goes on beyond its edges.
class Heights {
  public:
    explicit Heights(const Texture &image) : image_(image) {}
    int at(std::int64_t x, std::int64_t y) const {
        const std::size_t row = within(y, image_.height, image_.use.wrap[1]);
        return image_.texels[row * image_.width + within(x, image_.width, image_.use.wrap[0])][1];
    }

  private:
    static std::size_t within(std::int64_t at, std::uint32_t size, Wrap wrap) {
        if (wrap != Wrap::repeat)
            return static_cast<std::size_t>(std::clamp<std::int64_t>(at, 0, size - std::int64_t{1}));
        return static_cast<std::size_t>((at + size) % size);
    }
    const Texture &image_;
};

std::uint8_t to_byte(double part) { return static_cast<std::uint8_t>(std::floor((part + 1) * 127.5 + 0.5)); }

void heights_to_normals(Texture &image) {
    // Sobel's differences are 8 times those of a texel.
    const double slope = kBumpHeight * static_cast<double>(image.use.relief) * image.width / (8 * 255.0);
    const Heights heights(image);
    std::vector<std::array<std::uint8_t, 4>> normals;
    normals.reserve(image.texels.size());
    for (std::int64_t y = 0; y < image.height; ++y)
        for (std::int64_t x = 0; x < image.width; ++x) {
            int right = 0, down = 0;
            for (int along = -1; along <= 1; ++along) {
                const int weight = along == 0 ? 2 : 1;
                right += weight * (heights.at(x + 1, y + along) - heights.at(x - 1, y + along));
                down += weight * (heights.at(x + along, y + 1) - heights.at(x + along, y - 1));
            }
            const glm::dvec3 n = glm::normalize(glm::dvec3(-slope * right, slope * down, 1));
            normals.push_back({to_byte(n.x), to_byte(n.y), to_byte(n.z), 255});
        }
    image.texels = std::move(normals);
    image.use.relief = 1;
}

} // namespace

bool is_of_object(const Texture &image) {
    std::size_t inwards = 0;
    for (const auto &texel : image.texels) {
        double squared = 0;
        for (std::size_t c = 0; c < 3; ++c)
            squared += (texel[c] / 127.5 - 1) * (texel[c] / 127.5 - 1);
        constexpr double kLeast = 0.6, kMost = 1.5; // black, the background of an atlas, has 3
        inwards += texel[2] < 127 && squared > kLeast && squared < kMost ? 1U : 0U;
    }
    return 8 * inwards > image.texels.size();
}

bool settle_normals(Texture &image) {
    const bool are_heights = image.use.content == ImageContent::relief && is_grey(image);
    if (are_heights)
        heights_to_normals(image);
    else if (image.use.is_green_down)
        for (auto &texel : image.texels)
            texel[1] = static_cast<std::uint8_t>(255 - texel[1]);
    image.use.is_green_down = false;
    image.use.content = ImageContent::normals;
    return are_heights;
}

} // namespace pbm::build
