// TIFF images as files in memory, written by libtiff.
#pragma once

#include "system/bytes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>

#include <tiffio.h>

namespace pbm::test {

struct TiffKind {
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 8, samples = 3, photometric = PHOTOMETRIC_RGB, compression = COMPRESSION_NONE;
    bool is_float = false, is_tiled = false, is_planar = false, is_linear = false;
    std::uint16_t orientation = ORIENTATION_TOPLEFT, extra = EXTRASAMPLE_UNASSALPHA;
};

// `samples`: [height][width][samples], each of `bits` bits, as they are in memory.
inline Bytes tiff_of(const TiffKind &kind, const Bytes &samples) {
    const std::string path =
        (std::filesystem::temp_directory_path() / ("pbm_tiff." + std::to_string(getpid()))).string();
    TIFF *const tiff = TIFFOpen(path.c_str(), "w");
    const std::uint16_t colours = kind.photometric == PHOTOMETRIC_MINISBLACK  ? 1
                                  : kind.photometric == PHOTOMETRIC_SEPARATED ? 4
                                                                              : 3;
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kind.width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kind.height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
    if (kind.compression == COMPRESSION_JPEG)
        TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.is_planar ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
    if (kind.samples > colours)
        TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, std::uint16_t{1}, &kind.extra);
    std::vector<std::uint16_t> line(std::size_t{1} << kind.bits % 32);
    for (std::size_t i = 0; i < line.size(); ++i)
        line[i] = static_cast<std::uint16_t>(i);
    if (kind.is_linear)
        TIFFSetField(tiff, TIFFTAG_TRANSFERFUNCTION, line.data(), line.data(), line.data());
    constexpr std::uint32_t kEdge = 16;
    const std::uint32_t edge = kind.is_tiled ? kEdge : 0;
    if (kind.is_tiled) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, edge);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, edge);
    } else {
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, kEdge); // JPEG wants multiples of 16
    }
    const std::size_t bytes = kind.bits / 8U, pixel = bytes * kind.samples;
    const std::size_t block_width = kind.is_tiled ? edge : kind.width, block_height = kEdge;
    for (std::size_t plane = 0; plane < (kind.is_planar ? kind.samples : 1U); ++plane)
        for (std::size_t top = 0; top < kind.height; top += block_height)
            for (std::size_t left = 0; left < kind.width; left += block_width) {
                const std::size_t rows = kind.is_tiled ? block_height : std::min(block_height, kind.height - top);
                Bytes block;
                for (std::size_t y = top; y < top + rows; ++y)
                    for (std::size_t x = left; x < left + block_width; ++x) {
                        const std::size_t at = (std::min<std::size_t>(y, kind.height - 1) * kind.width +
                                                std::min<std::size_t>(x, kind.width - 1)) *
                                               pixel;
                        const auto from =
                            samples.begin() + static_cast<std::ptrdiff_t>(at + (kind.is_planar ? plane * bytes : 0));
                        block.insert(block.end(), from,
                                     from + static_cast<std::ptrdiff_t>(kind.is_planar ? bytes : pixel));
                    }
                const auto x = static_cast<std::uint32_t>(left), y = static_cast<std::uint32_t>(top);
                const auto sample = static_cast<std::uint16_t>(plane);
                const auto size = static_cast<tmsize_t>(block.size());
                const tmsize_t written =
                    kind.is_tiled
                        ? TIFFWriteEncodedTile(tiff, TIFFComputeTile(tiff, x, y, 0, sample), block.data(), size)
                        : TIFFWriteEncodedStrip(tiff, TIFFComputeStrip(tiff, y, sample), block.data(), size);
                EXPECT_EQ(written, size);
            }
    TIFFClose(tiff);
    std::ifstream file(path, std::ios::binary);
    Bytes whole((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    std::filesystem::remove(path);
    return whole;
}

} // namespace pbm::test
