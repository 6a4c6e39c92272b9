// Panoramas from image files: accepted and refused files, and every truncation.
#include "pbm_build/panorama/panorama.h"
#include "pbm_build/panorama/resample.h"
#include "pbm_format/model/point_values.h"
#include "pbm_scan/images/image_decoder.h"
#include "unit/support/image_files.h"
#include "unit/support/tiff_files.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <unistd.h>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::jpeg_of;
using test::png_of;

Bytes noise(std::size_t count) {
    std::mt19937 random(7);
    Bytes bytes(count);
    for (std::uint8_t &byte : bytes)
        byte = static_cast<std::uint8_t>(random());
    return bytes;
}

// Runs of one value per channel, as Radiance writes them.
Bytes hdr_of(std::uint32_t width, std::uint32_t height, std::uint8_t exponent) {
    const std::string head =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " + std::to_string(width) + "\n";
    Bytes bytes(head.begin(), head.end());
    for (std::uint32_t y = 0; y < height; ++y) {
        bytes.insert(bytes.end(), {2, 2, static_cast<std::uint8_t>(width >> 8), static_cast<std::uint8_t>(width)});
        for (const std::uint8_t value : {std::uint8_t{128}, std::uint8_t{64}, std::uint8_t{32}, exponent})
            for (std::uint32_t x = 0; x < width; x += 64)
                bytes.insert(bytes.end(), {128 + 64, value});
    }
    return bytes;
}

Status decode_all(ByteView bytes, Bytes &pixels) {
    pixels.clear();
    const Result<ImageFormat> format = image_format(bytes);
    if (!format)
        return format.error();
    if (*format == ImageFormat::hdr) {
        const auto decoded = decode_linear(bytes, *format);
        return decoded ? Status() : Status(decoded.error());
    }
    ImageRemarks remarks;
    return decode_rows(
        bytes, *format, 3,
        [&](std::span<const std::uint8_t> row) { pixels.insert(pixels.end(), row.begin(), row.end()); }, remarks);
}

std::string file_of(const Bytes &bytes) {
    const auto path = std::filesystem::temp_directory_path() / ("pbm_panorama_test." + std::to_string(getpid()));
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return path.string();
}

Result<Panorama> read(const Bytes &bytes, const PanoramaOptions &options = {}) {
    const std::string path = file_of(bytes);
    Result<Panorama> panorama = read_panorama(path, options);
    std::filesystem::remove(path);
    return panorama;
}

TEST(Panorama, APngOfAPowerOfTwoIsKeptAsItIs) {
    const Bytes pixels = noise(64 * 32 * 3);
    const auto panorama = read(png_of(64, 32, PNG_FORMAT_RGB, pixels.data()));
    ASSERT_TRUE(panorama.ok()) << panorama.error().message;
    EXPECT_EQ(panorama->image.width, 64U);
    EXPECT_EQ(panorama->image.height, 32U);
    EXPECT_EQ(panorama->image.texels, pixels);
    EXPECT_FALSE(panorama->converted);
    EXPECT_EQ(panorama->note, "PNG, 64 x 32");
}

TEST(Panorama, GreyAlphaAndSixteenBitsBecomeRgb) {
    const Bytes grey = noise(32 * 16);
    Bytes pixels;
    ASSERT_TRUE(decode_all(png_of(32, 16, PNG_FORMAT_GRAY, grey.data()), pixels).ok());
    for (std::size_t i = 0; i < grey.size(); ++i)
        ASSERT_TRUE(pixels[3 * i] == grey[i] && pixels[3 * i + 1] == grey[i] && pixels[3 * i + 2] == grey[i]);
    const Bytes rgba = noise(32 * 16 * 4);
    ASSERT_TRUE(decode_all(png_of(32, 16, PNG_FORMAT_RGBA, rgba.data()), pixels).ok());
    EXPECT_EQ(pixels.size(), 32U * 16 * 3);
    EXPECT_TRUE(std::equal(pixels.begin(), pixels.begin() + 3, rgba.begin()));
    std::vector<std::uint16_t> deep(32 * 16 * 3, 65535);
    ASSERT_TRUE(decode_all(png_of(32, 16, PNG_FORMAT_LINEAR_RGB, deep.data()), pixels).ok());
    EXPECT_EQ(pixels, Bytes(32 * 16 * 3, 255));
}

TEST(Panorama, EveryTruncationOfAnImageIsRefused) {
    const Bytes pixels = noise(32 * 16 * 3);
    const std::vector<Bytes> images{png_of(32, 16, PNG_FORMAT_RGB, pixels.data()), jpeg_of(32, 16, 3, false, pixels),
                                    jpeg_of(32, 16, 3, true, pixels), jpeg_of(32, 16, 1, false, pixels),
                                    hdr_of(64, 32, 129)};
    for (const Bytes &image : images) {
        Bytes decoded;
        ASSERT_TRUE(decode_all(image, decoded).ok()) << decode_all(image, decoded).error().message;
        for (std::size_t size = 0; size < image.size(); ++size) {
            const Status cut = decode_all(ByteView(image).first(size), decoded);
            ASSERT_FALSE(cut.ok()) << "of " << image.size() << " bytes " << size << " are enough";
            ASSERT_TRUE(cut.error().code == ErrorCode::bad_input || cut.error().code == ErrorCode::unsupported_feature);
        }
    }
}

TEST(Panorama, ImagesThatAreNoPanoramasAreRefused) {
    const Bytes pixels = noise(64 * 64 * 3);
    EXPECT_EQ(read({}).error().code, ErrorCode::bad_input);
    EXPECT_EQ(read({'p', 'l', 'y', '\n'}).error().code, ErrorCode::bad_input);
    const auto square = read(png_of(64, 64, PNG_FORMAT_RGB, pixels.data()));
    ASSERT_FALSE(square.ok());
    EXPECT_EQ(square.error().code, ErrorCode::bad_input);
    EXPECT_NE(square.error().message.find("64 x 64"), std::string::npos);
    EXPECT_EQ(read(jpeg_of(32, 16, 4, false, noise(32 * 16 * 4))).error().code, ErrorCode::unsupported_feature);
    EXPECT_EQ(read_panorama("/nowhere/x.png", {}).error().code, ErrorCode::io);
}

TEST(Panorama, AHugeImageIsRefusedByItsHeader) {
    Bytes huge = hdr_of(32, 16, 129);
    const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 50000 +X 100000\n";
    huge.assign(head.begin(), head.end());
    const auto refused = read(huge);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.find("100000 x 50000"), std::string::npos);
    const std::string negative = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y -16 +X -32\n";
    EXPECT_EQ(read(Bytes(negative.begin(), negative.end())).error().code, ErrorCode::bad_input);
}

TEST(Panorama, HdrIsToneMappedAboutItsMeanAndExposureBrightensIt) {
    const auto middle = read(hdr_of(64, 32, 120)), dark = read(hdr_of(64, 32, 120), {.width = 64, .exposure = 0.25});
    ASSERT_TRUE(middle.ok() && dark.ok());
    EXPECT_TRUE(middle->converted);
    // Every texel is the mean: 0.18 / 1.18 in linear light, times (2, 1, 1/2) / luminance.
    const auto luminance = [](const Panorama &p) {
        return 0.2126 * linear_table()[p.image.texels[0]] + 0.7152 * linear_table()[p.image.texels[1]] +
               0.0722 * linear_table()[p.image.texels[2]];
    };
    EXPECT_NEAR(luminance(*middle) / 65535, 0.18 / 1.18, 0.002);
    EXPECT_NEAR(luminance(*dark) / 65535, 0.045 / 1.045, 0.002);
    EXPECT_EQ(middle->image.texels, read(hdr_of(64, 32, 140))->image.texels) << "units of radiance do not matter";
}

TEST(Resample, AConstantStaysWhatItIsInAnySize) {
    for (const std::uint32_t to : {16U, 64U, 256U}) {
        PanoramaResampler resampler(100, 50, to, to / 2);
        const std::vector<std::uint16_t> row(300, linear_table()[77]);
        for (int y = 0; y < 50; ++y)
            resampler.add_row(row);
        const Image image = resampler.finish();
        EXPECT_EQ(image.texels, Bytes(std::size_t{to} * to / 2 * 3, 77));
    }
}

TEST(Resample, ColumnsGoOnAtTheOtherSide) {
    PanoramaResampler resampler(32, 16, 16, 8);
    std::vector<std::uint16_t> row(96, 0);
    row[0] = row[1] = row[2] = 65535; // the first column: part of the first and, across the seam, last texel
    for (int y = 0; y < 16; ++y)
        resampler.add_row(row);
    const Image image = resampler.finish();
    EXPECT_GT(image.texels[0], image.texels[45]);
    EXPECT_GT(image.texels[45], 0);
    EXPECT_EQ(image.texels[24], 0);
}

TEST(Panorama, OtherFormatsOfImages) {
    const Bytes pixels = noise(64 * 32 * 3);
    Bytes ppm = noise(0);
    for (const char letter : std::string_view("P6 64 32 255\n"))
        ppm.push_back(static_cast<std::uint8_t>(letter));
    ppm.insert(ppm.end(), pixels.begin(), pixels.end());
    const test::TiffKind kind{.width = 64, .height = 32, .compression = COMPRESSION_LZW, .orientation = 3};
    for (const Bytes &image : {ppm, test::tiff_of(kind, pixels)}) {
        const auto panorama = read(image);
        ASSERT_TRUE(panorama.ok()) << panorama.error().message;
        EXPECT_EQ(panorama->image.texels, pixels);
        EXPECT_FALSE(panorama->converted);
    }
    EXPECT_EQ(read(test::tiff_of(kind, pixels))->note, "TIFF, 64 x 32; its orientation (3) is not applied");
}

TEST(Panorama, ATiffOfFloatsIsToneMappedAsHdr) {
    Bytes samples;
    for (std::size_t i = 0; i < std::size_t{64} * 32; ++i)
        for (const float value : {128 / 256.0F, 64 / 256.0F, 32 / 256.0F}) {
            samples.resize(samples.size() + sizeof value);
            store(&samples[samples.size() - sizeof value], value);
        }
    const auto tiff = read(test::tiff_of({.width = 64, .height = 32, .bits = 32, .is_float = true}, samples));
    const auto hdr = read(hdr_of(64, 32, 128));
    ASSERT_TRUE(tiff.ok() && hdr.ok());
    EXPECT_EQ(tiff->image.texels, hdr->image.texels);
    EXPECT_EQ(tiff->note, "TIFF, 64 x 32, tone-mapped");
    EXPECT_TRUE(tiff->converted);
}

} // namespace
