#include "viewer/pictures/finish.h"

#include "pbm_render/appearance/shade_table.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm {
namespace {

// Based on: Hable. Uncharted 2: HDR Lighting. Game Developers Conference 2010
float film_response(float light) {
    constexpr float kShoulder = 0.15F, kLinear = 0.5F, kAngle = 0.1F, kToe = 0.2F, kToeTop = 0.02F, kToeFoot = 0.3F;
    return (light * (kShoulder * light + kAngle * kLinear) + kToe * kToeTop) /
               (light * (kShoulder * light + kLinear) + kToe * kToeFoot) -
           kToeTop / kToeFoot;
}

// From the light of a scene to that of the screen.
class Grade {
  public:
    explicit Grade(const Finish &finish)
        : gain_(static_cast<float>(std::exp2(finish.exposure))), is_filmic_(finish.tone == Tone::filmic),
          white_(film_response(std::max(gain_, 1.0F))) {}
    float operator()(float light) const {
        light = std::max(light * gain_, 0.0F);
        return is_filmic_ ? film_response(light) / white_ : light;
    }
    // Opaque.
    std::uint32_t pixel(Float4 light, const ColourTable &colours) const {
        return colours.pack_srgb(Float4{(*this)(light[0]), (*this)(light[1]), (*this)(light[2]), 0});
    }

  private:
    float gain_;
    bool is_filmic_;
    float white_;
};

// What is drawn, over what is behind it.
std::uint32_t over(std::uint32_t pixel, Rgba8 behind, const ColourTable &colours) {
    const float share = static_cast<float>(pixel >> 24) / 255, rest = (1 - share) * static_cast<float>(behind[3]) / 255;
    const float alpha = share + rest;
    if (alpha <= 0)
        return 0;
    const Float4 light = colours.linear(pixel) * share + colours.linear(pack_rgba(behind)) * rest;
    return (colours.pack_srgb(light / alpha) & 0xFFFFFF) | static_cast<std::uint32_t>(alpha * 255 + 0.5F) << 24;
}

} // namespace

RenderOptions before_finish(const Finish &finish, RenderOptions options) {
    if (!finish.is_none()) {
        options.background = {0, 0, 0, 0};
        options.background_below.reset();
    }
    return options;
}

void grade(const Finish &finish, Framebuffer &picture) {
    const ColourTable colours;
    const Grade graded(finish);
    std::array<std::uint8_t, 256> bytes{};
    for (std::uint32_t byte = 0; byte < 256; ++byte)
        bytes[byte] = static_cast<std::uint8_t>(graded.pixel(colours.linear(byte), colours));
    for (std::uint32_t &pixel : picture.colour) {
        const Rgba8 drawn = unpack_rgba(pixel);
        pixel = pack_rgba({bytes[drawn[0]], bytes[drawn[1]], bytes[drawn[2]], drawn[3]});
    }
}

void grade(const Finish &finish, std::span<const Float4> light, Framebuffer &picture) {
    const ColourTable colours;
    const Grade graded(finish);
    for (std::size_t at = 0; at < picture.pixels(); ++at)
        if (light[at][3] > 0)
            picture.colour[at] =
                (graded.pixel(light[at] / light[at][3], colours) & 0xFFFFFF) | (picture.colour[at] & 0xFF000000);
}

void add_background(const RenderOptions &options, Framebuffer &picture) {
    const ColourTable colours;
    std::uint32_t *pixel = picture.colour.data();
    for (int y = 0; y < picture.height; ++y) {
        const Rgba8 behind = background_at(options, (y + 0.5) / picture.height);
        for (int x = 0; x < picture.width; ++x, ++pixel)
            if (*pixel >> 24 < 255)
                *pixel = over(*pixel, behind, colours);
    }
}

} // namespace pbm
