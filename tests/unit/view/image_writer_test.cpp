#include "viewer/pictures/image_writer.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <functional>
#include <random>
#include <string>
#include <string_view>
#include <tuple>

namespace pbm {
namespace {

using Pixels = std::vector<std::uint32_t>; // pack_rgba, [height][width]
using Pattern = std::function<std::uint32_t(int x, int y)>;

Framebuffer painted(int width, int height, const Pattern &pattern) {
    Framebuffer picture(width, height);
    std::fill(picture.colour.begin(), picture.colour.end(), 0x55AA55AA); // the buffer is larger than the picture
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            picture
                .colour[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
                pattern(x, y);
    return picture;
}

Pixels pixels_of(const Framebuffer &picture) {
    return {picture.colour.begin(), picture.colour.begin() + static_cast<std::ptrdiff_t>(picture.pixels())};
}

// What libpng reads from a file.
struct Read {
    std::uint32_t width = 0, height = 0;
    bool alpha = false;
    Pixels pixels;
    std::string complaint; // errors and warnings
};

Read read_with_libpng(const Bytes &file) {
    Read read;
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_memory(&image, file.data(), file.size()) != 0) {
        read.width = image.width;
        read.height = image.height;
        read.alpha = (image.format & PNG_FORMAT_FLAG_ALPHA) != 0;
        read.pixels.resize(std::size_t{image.width} * image.height);
        image.format = PNG_FORMAT_RGBA;
        png_image_finish_read(&image, nullptr, read.pixels.data(), 0, nullptr);
    }
    read.complaint = image.message;
    return read;
}

void expect_round_trip(const Framebuffer &picture, bool alpha) {
    const Result<Bytes> file = encode_png(picture);
    ASSERT_TRUE(file);
    const Read read = read_with_libpng(*file);
    EXPECT_EQ(read.complaint, "");
    EXPECT_EQ(read.width, static_cast<std::uint32_t>(picture.width));
    EXPECT_EQ(read.height, static_cast<std::uint32_t>(picture.height));
    EXPECT_EQ(read.alpha, alpha);
    EXPECT_TRUE(read.pixels == pixels_of(picture)) << picture.width << " x " << picture.height;
}

// A shaded, noisy ball in front of `background`: a typical picture.
std::uint32_t ball(int x, int y, std::uint32_t background) {
    const int dx = x - 320, dy = y - 240, left = 200 * 200 - dx * dx - dy * dy;
    if (left < 0)
        return background;
    const auto shade = static_cast<std::uint8_t>(left / 200 + (x * 7 + y * 13) % 5);
    return pack_rgba({shade, static_cast<std::uint8_t>(shade / 2), 40, 255});
}

// Runs `use` several times, each time with other addresses of stack and heap.
void run_at_layouts(int layouts, const std::function<void()> &use) {
    if (layouts == 0)
        return;
    constexpr std::size_t kStep = std::size_t{1} << 16;
    volatile std::uint8_t stack[kStep];
    stack[0] = 0;
    const Bytes heap(kStep);
    use();
    run_at_layouts(layouts - 1, use);
    static_cast<void>(stack[0]); // keeps the array alive until the inner runs have ended
}

class EncodePngOfSize : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(EncodePngOfSize, ReadsBackAsItWas) {
    const auto [width, height] = GetParam();
    std::mt19937 random(1);
    expect_round_trip(painted(width, height, [&](int, int) { return random() | 0xFF000000U; }), false);
    expect_round_trip(painted(width, height, [](int, int) { return 0xFF604020U; }), false);
    expect_round_trip(painted(width, height, [](int x, int) { return 0xFF000000U + static_cast<unsigned>(x); }), false);
    expect_round_trip(painted(width, height, [](int, int y) { return 0xFF000000U + static_cast<unsigned>(y); }), false);
    expect_round_trip(painted(width, height, [](int, int) { return 0U; }), true);
    expect_round_trip(painted(width, height, [&](int, int) { return random() & 0x7FFFFFFFU; }), true);
}

// Includes rows that are longer than a band.
INSTANTIATE_TEST_SUITE_P(Sizes, EncodePngOfSize,
                         testing::Values(std::tuple(1, 1), std::tuple(2, 1), std::tuple(1, 2), std::tuple(3, 3),
                                         std::tuple(1, 997), std::tuple(997, 1), std::tuple(17, 31),
                                         std::tuple(211, 307), std::tuple(641, 479), std::tuple(kMaxPictureEdge, 5),
                                         std::tuple(5, kMaxPictureEdge)));

TEST(EncodePng, OnePixelThatIsNotOpaqueBringsAlpha) {
    Framebuffer picture = painted(640, 480, [](int x, int y) { return ball(x, y, 0xFF808080); });
    expect_round_trip(picture, false);
    picture.colour[picture.pixels() - 1] = 0xFE808080;
    expect_round_trip(picture, true);
}

TEST(EncodePng, HasTheSameBytesForAnyNumberOfThreads) {
    for (const std::uint32_t background : {0xFF808080U, 0x00000000U}) {
        const Framebuffer picture = painted(640, 480, [&](int x, int y) { return ball(x, y, background); });
        const Bytes expected = *encode_png(picture);
        for (const int threads : {0, 1, 2, 3, 64})
            for (int again = 0; again < 5; ++again)
                EXPECT_TRUE(*encode_png(picture, threads) == expected) << threads;
    }
}

TEST(EncodePng, HasTheSameBytesFromBandsInAnyOrder) {
    const Framebuffer picture = painted(640, 480, [&](int x, int y) { return ball(x, y, 0xFF808080); });
    PngBands bands(picture, true, 2);
    ASSERT_GT(bands.count(), 2U);
    for (std::size_t band = bands.count(); band-- > 0;)
        bands.encode(band, band % 2);
    EXPECT_TRUE(*bands.finish() == *encode_png(picture));
    EXPECT_EQ(bands.end_row(bands.count() - 1), picture.height);
    for (std::size_t band = 1; band < bands.count(); ++band)
        EXPECT_LT(bands.end_row(band - 1), bands.end_row(band));
}

// Small inputs have small hash tables in the compressor, where a dependence on addresses shows more often.
TEST(EncodePng, HasTheSameBytesWhereverItsMemoryLies) {
    std::mt19937 random(1);
    int different = 0;
    for (int picture = 0; picture < 200; ++picture) {
        const auto colour = static_cast<std::uint32_t>(random()), other = static_cast<std::uint32_t>(random());
        const Framebuffer small = painted(12, 4, [&](int x, int) { return x % 5 == 4 ? other : colour; });
        const Bytes expected = *encode_png(small);
        run_at_layouts(64, [&] { different += *encode_png(small) == expected ? 0 : 1; });
    }
    EXPECT_EQ(different, 0);
}

TEST(EncodePng, StartsAndEndsAsTheSpecificationSays) {
    using namespace std::string_view_literals;
    const Bytes file = *encode_png(painted(0x102, 3, [](int, int) { return 0xFF604020U; }));
    const std::string text(file.begin(), file.end());
    EXPECT_EQ(text.substr(0, 29), "\x89PNG\r\n\x1a\n\0\0\0\x0DIHDR\0\0\1\2\0\0\0\3\x08\2\0\0\0"sv);
    EXPECT_EQ(text.substr(33, 13), "\0\0\0\1sRGB\0\xAE\xCE\x1C\xE9"sv);
    EXPECT_EQ(text.substr(50, 6), "IDAT\x78\1"sv);
    EXPECT_EQ(text.substr(text.size() - 12), "\0\0\0\0IEND\xAE\x42\x60\x82"sv);
}

TEST(EncodePng, BackgroundCostsLittle) {
    const Framebuffer flat = painted(1280, 720, [](int, int) { return 0xFF808080U; });
    EXPECT_LT(encode_png(flat)->size(), flat.pixels() / 32);
    const Framebuffer sky = painted(1280, 720, [](int, int y) { return 0xFF000000U + static_cast<unsigned>(y) / 3; });
    EXPECT_LT(encode_png(sky)->size(), sky.pixels() / 32);
    // Noise does not compress, but must not grow much.
    std::mt19937 random(1);
    const Framebuffer noise = painted(1280, 720, [&](int, int) { return random() & 0x7FFFFFFFU; });
    EXPECT_LT(encode_png(noise)->size(), noise.pixels() * 4 * 101 / 100);
}

} // namespace
} // namespace pbm
