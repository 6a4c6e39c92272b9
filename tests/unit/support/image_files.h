// Images as files in memory.
#pragma once

#include "system/bytes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>
#include <png.h>

namespace pbm::test {

// `format`: of libpng's simplified interface, e.g. PNG_FORMAT_RGB.
inline Bytes png_of(std::uint32_t width, std::uint32_t height, std::uint32_t format, const void *pixels) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = width;
    image.height = height;
    image.format = format;
    png_alloc_size_t size = 0;
    EXPECT_NE(png_image_write_to_memory(&image, nullptr, &size, 0, pixels, 0, nullptr), 0);
    Bytes bytes(size);
    EXPECT_NE(png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr), 0);
    return bytes;
}

// RGB of 16 bits, as programs write it that say nothing of its gamma: without the chunk that libpng adds.
inline Bytes png16_of(std::uint32_t width, std::uint32_t height, const std::uint16_t *pixels) {
    const Bytes with_gamma = png_of(width, height, PNG_FORMAT_LINEAR_RGB, pixels);
    constexpr std::size_t kSignature = 8, kAround = 12; // length, type, CRC
    Bytes bytes(with_gamma.begin(), with_gamma.begin() + kSignature);
    for (std::size_t at = kSignature; at + kAround <= with_gamma.size();) {
        const std::size_t size = kAround + (std::size_t{with_gamma[at + 2]} << 8 | with_gamma[at + 3]);
        const std::string type(with_gamma.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                               with_gamma.begin() + static_cast<std::ptrdiff_t>(at) + 8);
        if (type == "IHDR" || type == "IDAT" || type == "IEND")
            bytes.insert(bytes.end(), with_gamma.begin() + static_cast<std::ptrdiff_t>(at),
                         with_gamma.begin() + static_cast<std::ptrdiff_t>(at + size));
        at += size;
    }
    return bytes;
}

inline Bytes jpeg_of(std::uint32_t width, std::uint32_t height, int channels, bool progressive, Bytes pixels) {
    jpeg_compress_struct info{};
    jpeg_error_mgr errors{};
    info.err = jpeg_std_error(&errors);
    jpeg_create_compress(&info);
    unsigned char *memory = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&info, &memory, &size);
    info.image_width = width;
    info.image_height = height;
    info.input_components = channels;
    info.in_color_space = channels == 1 ? JCS_GRAYSCALE : channels == 3 ? JCS_RGB : JCS_CMYK;
    jpeg_set_defaults(&info);
    if (progressive)
        jpeg_simple_progression(&info);
    jpeg_start_compress(&info, TRUE);
    for (std::uint32_t y = 0; y < height; ++y) {
        JSAMPROW row = pixels.data() + std::size_t{y} * width * static_cast<std::size_t>(channels);
        jpeg_write_scanlines(&info, &row, 1);
    }
    jpeg_finish_compress(&info);
    Bytes bytes(memory, memory + size);
    jpeg_destroy_compress(&info);
    std::free(memory); // NOLINT: libjpeg allocated it
    return bytes;
}

} // namespace pbm::test
