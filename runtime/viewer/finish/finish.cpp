#include "viewer/finish/finish.h"

#include "pbm_render/appearance/legend.h"
#include "pbm_render/appearance/shade_table.h"
#include "viewer/finish/scale_bar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

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

// What is drawn, over a shadow of this opacity, over what is behind it.
std::uint32_t over(std::uint32_t pixel, float shadow, Rgba8 behind, const ColourTable &colours) {
    const float share = static_cast<float>(pixel >> 24) / 255, around = static_cast<float>(behind[3]) / 255;
    const float lit = (1 - share) * (1 - shadow) * around;
    const float alpha = share + (1 - share) * shadow + lit;
    if (alpha <= 0)
        return 0;
    const Float4 light = colours.linear(pixel) * share + colours.linear(pack_rgba(behind)) * lit;
    return (colours.pack_srgb(light / alpha) & 0xFFFFFF) | static_cast<std::uint32_t>(alpha * 255 + 0.5F) << 24;
}

// Means over 2 * radius + 1 values, of which those outside of `values` are 0. Strides are numbers of floats.
void box_blur(float *values, std::size_t count, std::size_t stride, int radius, std::vector<float> &scratch) {
    scratch.assign(count + 1, 0);
    for (std::size_t i = 0; i < count; ++i)
        scratch[i + 1] = scratch[i] + values[i * stride];
    const auto edge = static_cast<std::size_t>(radius);
    for (std::size_t i = 0; i < count; ++i)
        values[i * stride] = (scratch[std::min(i + edge + 1, count)] - scratch[i - std::min(i, edge)]) /
                             static_cast<float>(2 * radius + 1);
}

// The opacity of the shadow of what is drawn. Two blurs are a soft edge without steps.
std::vector<float> drop_shadow(const Framebuffer &picture) {
    constexpr double kBlur = 0.02, kDown = 0.012; // of the smaller edge
    constexpr float kOpacity = 0.42F;
    const int edge = std::min(picture.width, picture.height), move = std::max(1, static_cast<int>(edge * kDown));
    const int radius = std::max(1, static_cast<int>(edge * kBlur));
    const auto columns = static_cast<std::size_t>(picture.width), rows = static_cast<std::size_t>(picture.height);
    const auto moved = static_cast<std::size_t>(move);
    std::vector<float> shadow(picture.pixels()), scratch;
    for (std::size_t y = moved; y < rows; ++y)
        for (std::size_t x = moved; x < columns; ++x)
            shadow[y * columns + x] =
                kOpacity * static_cast<float>(picture.colour[(y - moved) * columns + x - moved] >> 24) / 255;
    for (int i = 0; i < 2; ++i) {
        for (std::size_t y = 0; y < rows; ++y)
            box_blur(shadow.data() + y * columns, columns, 1, radius, scratch);
        for (std::size_t x = 0; x < columns; ++x)
            box_blur(shadow.data() + x, rows, columns, radius, scratch);
    }
    return shadow;
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

void add_background(const Finish &finish, const RenderOptions &options, Framebuffer &picture) {
    const ColourTable colours;
    const std::vector<float> shadow = finish.drop_shadow ? drop_shadow(picture) : std::vector<float>();
    std::uint32_t *pixel = picture.colour.data();
    for (int y = 0; y < picture.height; ++y) {
        const Rgba8 behind = background_at(options, (y + 0.5) / picture.height);
        for (int x = 0; x < picture.width; ++x, ++pixel)
            if (*pixel >> 24 < 255)
                *pixel =
                    over(*pixel, shadow.empty() ? 0 : shadow[static_cast<std::size_t>(pixel - picture.colour.data())],
                         behind, colours);
    }
}

void add_scale_bar(const Finish &finish, double pixel_size, Unit unit, Framebuffer &picture) {
    if (!finish.scale_bar)
        return;
    constexpr double kShare = 0.3, kLetter = 2.2 / 25.4; // of the width; inches, the height of capitals
    const ScaleBar bar = scale_bar(pixel_size, kShare * picture.width, unit);
    draw_bar(static_cast<int>(std::lround(bar.pixels)), bar.text, static_cast<int>(kLetter * finish.dpi), picture);
}

} // namespace pbm
