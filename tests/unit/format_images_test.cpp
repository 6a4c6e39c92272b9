// Rasters with mip levels in tiles: BVG.md section 3.10.
#include "pbm_format/tiled_image.h"

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <thread>

namespace pbm {
namespace {

// Smooth with some noise, so that both zstd and raw tiles occur.
Image test_image(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    Image image{.width = width, .height = height, .channels = channels, .texels = {}};
    std::uint32_t random = 1;
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            for (std::uint32_t c = 0; c < channels; ++c) {
                random = random * 1664525 + 1013904223;
                const std::uint32_t noise = x < width / 2 ? random >> 30 : random >> 24;
                image.texels.push_back(static_cast<std::uint8_t>(x * 100 / width + y * 50 / height + c * 30 + noise));
            }
    return image;
}

std::vector<Image> levels_of(const Image &image) {
    std::vector<Image> levels{image};
    while (levels.back().height > 1)
        levels.push_back(halved(levels.back()));
    return levels;
}

void expect_same_texels(const TiledImage &tiled, const Image &image) {
    const std::vector<Image> levels = levels_of(image);
    ASSERT_EQ(tiled.levels(), static_cast<int>(levels.size()));
    for (int level = 0; level < tiled.levels(); ++level) {
        const Image &expected = levels[static_cast<std::size_t>(level)];
        ASSERT_EQ(tiled.width(level), expected.width);
        ASSERT_EQ(tiled.height(level), expected.height);
        std::size_t at = 0;
        for (std::uint32_t y = 0; y < expected.height; ++y)
            for (std::uint32_t x = 0; x < expected.width; ++x, at += expected.channels) {
                const std::uint8_t *texel = tiled.texel(level, x, y);
                ASSERT_NE(texel, nullptr);
                for (std::size_t c = 0; c < expected.channels; ++c)
                    ASSERT_EQ(texel[c], expected.texels[at + c]) << level << " " << x << " " << y;
            }
        EXPECT_EQ(tiled.level_image(level, 2).value(), expected);
    }
}

// The figure in BVG.md 3.10.15.
TEST(Image, MipLevelsAreMeansInLinearLightOrOfValues) {
    EXPECT_EQ(halved({.width = 2, .height = 2, .channels = 1, .texels = {0, 1, 2, 255}}).texels, Bytes({65}));
    EXPECT_EQ(halved({.width = 2, .height = 2, .channels = 1, .texels = {0, 0, 1, 1}}).texels, Bytes({1}));
    EXPECT_EQ(
        halved({.width = 2, .height = 2, .channels = 3, .texels = {0, 0, 9, 0, 0, 9, 255, 1, 9, 255, 0, 9}}).texels,
        Bytes({188, 0, 9}));
    EXPECT_EQ(mip_levels(1), 1);
    EXPECT_EQ(mip_levels(8192), 14);
}

TEST(TiledImage, MemoryAndFilesHoldTheSameTexels) {
    for (const auto &[width, height, channels] :
         {std::array{256U, 128U, 3U}, std::array{2U, 1U, 3U}, std::array{1U, 1U, 1U}, std::array{256U, 256U, 1U},
          std::array{64U, 64U, 1U}, std::array{32U, 16U, 3U}}) {
        const Image image = test_image(width, height, channels);
        expect_same_texels(TiledImage::of(image), image);
        for (const Storage storage : {Storage::packed, Storage::mapped}) {
            const Bytes section = encode_image(image, storage, 3, 2);
            EXPECT_EQ(section, encode_image(image, storage, 3, 1));
            const Result<TiledImage> tiled = TiledImage::open(section, 1000);
            ASSERT_TRUE(tiled) << tiled.error().message;
            expect_same_texels(*tiled, image);
            EXPECT_TRUE(tiled->take_errors().empty());
        }
    }
}

TEST(TiledImage, ReadsOnlyTheTilesThatAreAskedFor) {
    const Bytes section = encode_image(test_image(256, 256, 1), Storage::packed, 3, 1);
    const Result<TiledImage> tiled = TiledImage::open(section, 0);
    ASSERT_TRUE(tiled);
    const TiledImage::Statistics before = tiled->statistics();
    EXPECT_EQ(before.tiles, 0U);
    EXPECT_EQ(before.stored_bytes, 32 + 16 * tiled->grid().tiles());
    const std::uint8_t *texels = tiled->tile(0, 1, 2);
    EXPECT_EQ(texels, tiled->tile(0, 1, 2));
    const TiledImage::Statistics after = tiled->statistics();
    EXPECT_EQ(after.tiles, 1U);
    EXPECT_EQ(after.memory_bytes, before.memory_bytes + 4096);
    EXPECT_LT(after.stored_bytes, before.stored_bytes + 4096);
}

TEST(TiledImage, RawTilesAreUsedWhereTheyLie) {
    const Bytes section = encode_image(test_image(128, 128, 1), Storage::mapped, 3, 1);
    const Result<TiledImage> tiled = TiledImage::open(section, 0);
    ASSERT_TRUE(tiled);
    const std::uint8_t *texels = tiled->tile(0, 1, 1);
    EXPECT_TRUE(texels >= section.data() && texels < section.data() + section.size());
    EXPECT_EQ((texels - section.data()) % kMappedStreamAlignment, 0);
}

TEST(TiledImage, ADamagedTileIsAnErrorAndTheOthersStayUsable) {
    const Image image = test_image(256, 128, 3);
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes section = encode_image(image, storage, 3, 1);
        const Result<ImageDirectory> directory = decode_image_directory(section, 0);
        ASSERT_TRUE(directory);
        const std::size_t number = directory->grid.tile_number(0, 3, 1);
        section[directory->tiles[number].offset + 5] ^= 1;
        const Result<TiledImage> tiled = TiledImage::open(section, 5000);
        ASSERT_TRUE(tiled);
        EXPECT_EQ(tiled->tile(0, 3, 1), nullptr);
        EXPECT_EQ(tiled->tile(0, 3, 1), nullptr);
        EXPECT_EQ(tiled->texel(0, 255, 127), nullptr);
        const std::uint8_t *other = tiled->texel(0, 100, 100);
        ASSERT_NE(other, nullptr);
        EXPECT_EQ(other[2], image.texels[3 * (100 * 256 + 100) + 2]);
        const std::vector<Error> errors = tiled->take_errors();
        ASSERT_EQ(errors.size(), 1U);
        EXPECT_EQ(errors[0].code, ErrorCode::bad_hash);
        EXPECT_EQ(errors[0].offset, 5000 + directory->tiles[number].offset);
        EXPECT_TRUE(tiled->take_errors().empty());
        EXPECT_FALSE(tiled->level_image(0));
        EXPECT_TRUE(tiled->level_image(1));
    }
}

TEST(TiledImage, SeveralThreadsSeeTheSameTiles) {
    const Image image = test_image(512, 256, 3);
    const Bytes section = encode_image(image, Storage::packed, 3, 2);
    const Result<TiledImage> tiled = TiledImage::open(section, 0);
    ASSERT_TRUE(tiled);
    std::atomic<int> wrong{0};
    {
        std::vector<std::jthread> threads;
        for (std::uint32_t t = 0; t < 4; ++t)
            threads.emplace_back([&, t] {
                for (std::uint32_t i = 0; i < 512 * 256; i += 97) {
                    const std::uint32_t x = (i + t) % 512, y = i / 512;
                    const std::uint8_t *texel = tiled->texel(0, x, y);
                    wrong += texel == nullptr || texel[1] != image.texels[3 * (y * 512 + x) + 1] ? 1 : 0;
                }
            });
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(tiled->statistics().tiles, 8U * 4U);
}

TEST(TiledImage, EveryTruncationAndEveryFlippedBitOfTheDirectoryIsRefused) {
    Bytes section = encode_image(test_image(128, 64, 3), Storage::packed, 3, 1);
    for (std::size_t bytes = 0; bytes < section.size(); ++bytes)
        EXPECT_FALSE(TiledImage::open(ByteView(section).first(bytes), 0)) << bytes;
    const std::size_t directory_bytes = image_directory_bytes(TiledImage::open(section, 0)->grid());
    for (std::size_t bit = 0; bit < 8 * directory_bytes; ++bit) {
        section[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
        EXPECT_FALSE(TiledImage::open(section, 0)) << bit;
        section[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    }
}

} // namespace
} // namespace pbm
