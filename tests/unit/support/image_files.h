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
