#include "png_peer.h"

#include <png.h>

#include <stdexcept>

namespace pbm::bench {

Framebuffer read_png(const std::string &path) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_file(&image, path.c_str()) == 0)
        throw std::runtime_error(path + ": " + image.message);
    image.format = PNG_FORMAT_RGBA;
    Framebuffer picture(static_cast<int>(image.width), static_cast<int>(image.height));
    if (png_image_finish_read(&image, nullptr, picture.colour.data(), 0, nullptr) == 0)
        throw std::runtime_error(path + ": " + image.message);
    return picture;
}

Bytes write_png(const Framebuffer &picture, bool opaque, bool fast) {
    Bytes pixels;
    pixels.reserve(picture.pixels() * (opaque ? 3 : 4));
    for (std::size_t at = 0; at < picture.pixels(); ++at) {
        const Rgba8 rgba = unpack_rgba(picture.colour[at]);
        pixels.insert(pixels.end(), rgba.begin(), rgba.end() - (opaque ? 1 : 0));
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
    image.flags = fast ? PNG_IMAGE_FLAG_FAST : 0;
    Bytes file(PNG_IMAGE_PNG_SIZE_MAX(image));
    png_alloc_size_t size = file.size();
    if (png_image_write_to_memory(&image, file.data(), &size, 0, pixels.data(), 0, nullptr) == 0)
        throw std::runtime_error(image.message);
    file.resize(size);
    return file;
}

} // namespace pbm::bench
