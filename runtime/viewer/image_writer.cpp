#include "viewer/image_writer.h"

#include <png.h>

#include <algorithm>
#include <span>
#include <string>

namespace pbm {

Result<Bytes> encode_png(const Framebuffer &picture) {
    const std::span<const std::uint32_t> colours(picture.colour.data(), picture.pixels());
    const bool opaque = std::all_of(colours.begin(), colours.end(), [](std::uint32_t c) { return c >> 24 == 255; });
    Bytes pixels;
    pixels.reserve(colours.size() * (opaque ? 3 : 4));
    for (const std::uint32_t c : colours) {
        const Rgba8 rgba = unpack_rgba(c);
        pixels.insert(pixels.end(), rgba.begin(), rgba.end() - (opaque ? 1 : 0));
    }

    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
    image.flags = PNG_IMAGE_FLAG_FAST;
    Bytes file(PNG_IMAGE_PNG_SIZE_MAX(image));
    png_alloc_size_t size = file.size();
    if (png_image_write_to_memory(&image, file.data(), &size, 0, pixels.data(), 0, nullptr) == 0)
        return Error{ErrorCode::memory, 0, std::string("the PNG encoder failed: ") + image.message};
    file.resize(size);
    return file;
}

Bytes encode_depth_pfm(const Framebuffer &picture) {
    const std::string header =
        "Pf\n" + std::to_string(picture.width) + " " + std::to_string(picture.height) + "\n-1.0\n";
    const auto row_bytes = static_cast<std::size_t>(picture.width) * sizeof(float);
    Bytes file(header.size() + row_bytes * static_cast<std::size_t>(picture.height));
    std::copy(header.begin(), header.end(), file.begin());
    const auto *const depths = reinterpret_cast<const std::uint8_t *>(picture.depth.data());
    for (std::size_t y = 0; y < static_cast<std::size_t>(picture.height); ++y) {
        const std::size_t from_bottom = static_cast<std::size_t>(picture.height) - 1 - y;
        std::copy_n(depths + from_bottom * row_bytes, row_bytes, file.data() + header.size() + y * row_bytes);
    }
    return file;
}

} // namespace pbm
