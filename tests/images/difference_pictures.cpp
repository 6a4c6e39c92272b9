#include "difference_pictures.h"

#include "system/files/file_replacement.h"
#include "viewer/pictures/image_writer.h"

#include <algorithm>
#include <stdexcept>

namespace pbm {
namespace {

constexpr int kAmplified = 8;

} // namespace

void write_picture(const std::string &path, const Framebuffer &picture) {
    const Result<Bytes> png = encode_png(picture, 0);
    if (!png)
        throw std::runtime_error(path + ": " + png.error().message);
    if (const Status written = replace_file(path, *png); !written)
        throw std::runtime_error(path + ": " + written.error().message);
}

void write_picture(const std::string &path, std::span<const Srgb> picture, int width, int height) {
    Framebuffer pixels(width, height, false);
    for (std::size_t i = 0; i < pixels.pixels(); ++i)
        pixels.colour[i] = pack_rgb(picture[i]) | 0xFF000000U;
    write_picture(path, pixels);
}

void write_difference(const std::string &path, std::span<const Srgb> truth, const Framebuffer &picture) {
    Framebuffer pixels(picture.width, picture.height, false);
    for (std::size_t i = 0; i < pixels.pixels(); ++i) {
        Rgba8 colour = unpack_rgba(picture.colour[i]);
        for (std::size_t channel = 0; channel < 3; ++channel)
            colour[channel] =
                static_cast<std::uint8_t>(std::clamp(128 + kAmplified * (colour[channel] - truth[i][channel]), 0, 255));
        colour[3] = 255;
        pixels.colour[i] = pack_rgba(colour);
    }
    write_picture(path, pixels);
}

} // namespace pbm
