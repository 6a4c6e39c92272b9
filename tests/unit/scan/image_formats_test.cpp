// Images in all formats that are decoded, damaged ones, and what is said of them.
#include "pbm_format/model/point_values.h"
#include "pbm_scan/images/read_image.h"
#include "pbm_scan/surface_reader.h"
#include "unit/support/image_files.h"
#include "unit/support/tiff_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <unistd.h>
#include <utility>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::TiffKind;

constexpr std::uint32_t kWidth = 20, kHeight = 12;
using Pixel = std::array<std::uint8_t, 4>;

// Two colours of 5 bits in each column, which every format has.
Pixel pixel_of(std::size_t x, std::size_t y) {
    return {static_cast<std::uint8_t>(x * 8), static_cast<std::uint8_t>(y * 16),
            static_cast<std::uint8_t>(x < 10 ? 0 : 248), static_cast<std::uint8_t>(y < 6 ? 255 : 64)};
}

enum class Order : std::uint8_t { rgb, bgr };
// Rows of the picture; `channels` 1: its red.
Bytes pixels_of(std::size_t channels, Order order = Order::rgb, bool from_below = false) {
    Bytes pixels;
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x) {
            Pixel pixel = pixel_of(x, from_below ? kHeight - 1 - y : y);
            if (order == Order::bgr)
                std::swap(pixel[0], pixel[2]);
            pixels.insert(pixels.end(), pixel.begin(), pixel.begin() + static_cast<std::ptrdiff_t>(channels));
        }
    return pixels;
}

void add(Bytes &to, const Bytes &more) { to.insert(to.end(), more.begin(), more.end()); }
void add(Bytes &to, std::string_view text) { to.insert(to.end(), text.begin(), text.end()); }
template <class T> void add_little(Bytes &to, std::initializer_list<T> values) {
    for (const T value : values)
        for (std::size_t i = 0; i < sizeof(T); ++i)
            to.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}
template <class T> void add_big(Bytes &to, std::initializer_list<T> values) {
    for (const T value : values)
        for (std::size_t i = sizeof(T); i-- > 0;)
            to.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

// Rows from below, as usual, or from above, with runs of one pixel.
Bytes tga_of(std::uint8_t bits, bool is_packed) {
    Bytes tga{0, 0, static_cast<std::uint8_t>(is_packed ? 10 : 2), 0, 0, 0, 0, 0, 0, 0, 0, 0};
    add_little<std::uint16_t>(tga, {kWidth, kHeight});
    tga.insert(tga.end(), {bits, static_cast<std::uint8_t>(is_packed ? 0x20 : 0)});
    const std::size_t bytes = bits / 8U;
    const Bytes pixels = pixels_of(bytes, Order::bgr, !is_packed);
    for (std::size_t at = 0; at < pixels.size(); at += bytes) {
        if (is_packed)
            tga.push_back(0x80);
        tga.insert(tga.end(), pixels.begin() + static_cast<std::ptrdiff_t>(at),
                   pixels.begin() + static_cast<std::ptrdiff_t>(at + bytes));
    }
    return tga;
}

Bytes bmp_of() {
    const Bytes pixels = pixels_of(3, Order::bgr, true); // 60 bytes a row: no padding
    Bytes bmp{'B', 'M'};
    add_little<std::uint32_t>(bmp, {static_cast<std::uint32_t>(54 + pixels.size()), 0, 54, 40, kWidth, kHeight});
    add_little<std::uint16_t>(bmp, {1, 24});
    add_little<std::uint32_t>(bmp, {0, static_cast<std::uint32_t>(pixels.size()), 2835, 2835, 0, 0});
    add(bmp, pixels);
    return bmp;
}

// Codes of 8 bits: the table is cleared before it grows. Index 1 is transparent. A second frame follows.
Bytes gif_of() {
    Bytes gif;
    add(gif, "GIF89a");
    add_little<std::uint16_t>(gif, {kWidth, kHeight});
    gif.insert(gif.end(), {0xF6, 0, 0}); // a table of 128 colours
    for (std::size_t i = 0; i < 128; ++i)
        add(gif, Bytes{static_cast<std::uint8_t>(2 * i), static_cast<std::uint8_t>(255 - i), 7});
    for (std::uint8_t frame = 0; frame < 2; ++frame) {
        add(gif, Bytes{0x21, 0xF9, 4, 1, 0, 0, 1, 0, 0x2C, 0, 0, 0, 0});
        add_little<std::uint16_t>(gif, {kWidth, kHeight});
        add(gif, Bytes{0, 7});
        for (std::uint8_t y = 0; y < kHeight; ++y) {
            add(gif, Bytes{kWidth + 1, 0x80}); // clear
            for (std::uint8_t x = 0; x < kWidth; ++x)
                gif.push_back(static_cast<std::uint8_t>(frame == 0 ? x + y : 99));
        }
        add(gif, Bytes{1, 0x81, 0}); // end
    }
    gif.push_back(0x3B);
    return gif;
}

Bytes psd_of(std::uint16_t depth) {
    Bytes psd;
    add(psd, "8BPS");
    add_big<std::uint16_t>(psd, {1, 0, 0, 0, 3});
    add_big<std::uint32_t>(psd, {kHeight, kWidth});
    add_big<std::uint16_t>(psd, {depth, 3});
    add_big<std::uint32_t>(psd, {0, 0, 0});
    add_big<std::uint16_t>(psd, {0}); // not packed
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t y = 0; y < kHeight; ++y)
            for (std::size_t x = 0; x < kWidth; ++x)
                psd.insert(psd.end(), depth / 8, pixel_of(x, y)[c]);
    return psd;
}

Bytes pnm_of(std::string_view head, std::size_t channels, std::size_t repeated) {
    Bytes pnm;
    add(pnm, head);
    for (const std::uint8_t value : pixels_of(channels))
        pnm.insert(pnm.end(), repeated, value);
    return pnm;
}

// Blocks of one colour each.
Bytes dds_of(std::string_view code, const Bytes &block, std::uint32_t number = 0) {
    Bytes dds;
    add(dds, "DDS ");
    add_little<std::uint32_t>(dds, {124, 0x1007, kHeight, kWidth, 0, 0, 0});
    dds.resize(76);
    add_little<std::uint32_t>(dds, {32, 4});
    add(dds, code);
    dds.resize(128);
    if (code == "DX10")
        add_little<std::uint32_t>(dds, {number, 3, 0, 1, 0});
    for (std::size_t i = 0; i < kWidth / 4 * (kHeight / 4); ++i)
        add(dds, block);
    return dds;
}

template <class T> Bytes as_samples(std::size_t channels, T (*of)(std::uint8_t)) {
    Bytes samples;
    for (const std::uint8_t value : pixels_of(channels)) {
        const T sample = of(value);
        const std::size_t at = samples.size();
        samples.resize(at + sizeof sample);
        std::memcpy(&samples[at], &sample, sizeof sample);
    }
    return samples;
}
std::uint16_t wide(std::uint8_t value) { return static_cast<std::uint16_t>(value * 257); }
float linear(std::uint8_t value) { return static_cast<float>(linear_table()[value]) / 65535.0F; }
double linear_double(std::uint8_t value) { return static_cast<double>(linear(value)); }
std::uint16_t linear_wide(std::uint8_t value) { return linear_table()[value]; }

TiffKind kind_of(std::uint16_t samples) { return {.width = kWidth, .height = kHeight, .samples = samples}; }

void expect_picture(const Bytes &image, const char *name, std::size_t channels, int tolerance = 0) {
    const Result<Texture> read = read_image(image);
    ASSERT_TRUE(read.ok()) << name << ": " << read.error().message;
    ASSERT_EQ(read->width, kWidth) << name;
    ASSERT_EQ(read->height, kHeight) << name;
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x) {
            const Pixel own = pixel_of(x, y), &texel = read->texels[y * kWidth + x];
            for (std::size_t c = 0; c < 4; ++c) {
                const int expected = c == 3 && channels != 4 ? 255 : channels == 1 ? own[0] : own[c];
                ASSERT_NEAR(texel[c], expected, tolerance) << name << " at " << x << ", " << y << ", channel " << c;
            }
        }
}

std::vector<std::pair<const char *, Bytes>> pictures() {
    return {{"tga", tga_of(24, false)},
            {"tga, packed", tga_of(32, true)},
            {"bmp", bmp_of()},
            {"gif", gif_of()},
            {"psd", psd_of(8)},
            {"ppm", pnm_of("P6\n# 12 13\n20 12\n255\n", 3, 1)},
            {"ppm, 16 bits", pnm_of("P6 20 12 65535\n", 3, 2)},
            {"tiff", test::tiff_of(kind_of(3), pixels_of(3))},
            {"tiff, packed",
             test::tiff_of({.width = kWidth, .height = kHeight, .compression = COMPRESSION_LZW}, pixels_of(3))},
            {"dds", dds_of("DXT1", {0, 0xF8, 0, 0, 0, 0, 0, 0})}};
}

TEST(ImageFormats, PicturesOfPrograms) {
    expect_picture(tga_of(24, false), "tga", 3);
    expect_picture(tga_of(32, false), "tga with opacity", 4);
    expect_picture(tga_of(32, true), "tga, packed, from above", 4);
    expect_picture(bmp_of(), "bmp", 3);
    expect_picture(psd_of(8), "psd", 3);
    expect_picture(psd_of(16), "psd, 16 bits", 3);
    expect_picture(pnm_of("P6\n# 12 13\n20 12\n255\n", 3, 1), "ppm", 3);
    expect_picture(pnm_of("P5 20 12 255\n", 1, 1), "pgm", 1);
    expect_picture(pnm_of("P5 20 12 65535\n", 1, 2), "pgm, 16 bits", 1);
    expect_picture(pnm_of("P6 20 12 65535\n", 3, 2), "ppm, 16 bits", 3);
}

TEST(ImageFormats, TheFirstFrameOfAGifAndItsTransparentColour) {
    const Result<Texture> gif = read_image(gif_of());
    ASSERT_TRUE(gif.ok()) << gif.error().message;
    EXPECT_EQ(gif->texels[kWidth + 4], (Pixel{10, 250, 7, 255})); // index 5
    EXPECT_EQ(gif->texels[1][3], 0);                              // index 1
    EXPECT_EQ(gif->texels[2][3], 255);
}

TEST(ImageFormats, TheWhiteOfAPnm) {
    const Bytes samples{0, 50, 100};
    Bytes pnm;
    add(pnm, "P5 3 1 100\n");
    add(pnm, samples);
    const Result<Texture> read = read_image(pnm);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->texels[0][0], 0);
    EXPECT_EQ(read->texels[1][0], 128);
    EXPECT_EQ(read->texels[2][0], 255);
}

TEST(ImageFormats, KindsOfTiff) {
    for (const int packing : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
        for (const bool tiled : {false, true})
            for (const bool planar : {false, true}) {
                TiffKind kind = kind_of(3);
                kind.compression = static_cast<std::uint16_t>(packing);
                kind.is_tiled = tiled;
                kind.is_planar = planar;
                expect_picture(test::tiff_of(kind, pixels_of(3)), "tiff", 3);
                kind.bits = 16;
                expect_picture(test::tiff_of(kind, as_samples(3, wide)), "tiff, 16 bits", 3);
                kind.bits = 32;
                kind.is_float = true;
                expect_picture(test::tiff_of(kind, as_samples(3, linear)), "tiff, floats", 3);
            }
    }
    TiffKind kind = kind_of(1);
    kind.photometric = PHOTOMETRIC_MINISBLACK;
    expect_picture(test::tiff_of(kind, pixels_of(1)), "tiff, grey", 1);
    kind.bits = 64;
    kind.is_float = true;
    expect_picture(test::tiff_of(kind, as_samples(1, linear_double)), "tiff, grey doubles", 1);
    kind = kind_of(4);
    expect_picture(test::tiff_of(kind, pixels_of(4)), "tiff with opacity", 4, 2);
    kind.bits = 32;
    kind.is_float = true;
    Bytes opaque = as_samples<float>(4, [](std::uint8_t value) { return static_cast<float>(value) / 255; });
    const Result<Texture> floats = read_image(test::tiff_of(kind, opaque));
    ASSERT_TRUE(floats.ok()) << floats.error().message;
    EXPECT_EQ(floats->texels[kWidth * kHeight - 1][3], 64);
    kind = {.width = kWidth, .height = kHeight, .photometric = PHOTOMETRIC_YCBCR, .compression = COMPRESSION_JPEG};
    const Result<Texture> jpeg = read_image(test::tiff_of(kind, Bytes(kWidth * kHeight * 3, 128)));
    ASSERT_TRUE(jpeg.ok()) << jpeg.error().message;
    EXPECT_NEAR(jpeg->texels[50][0], 128, 2);
}

TEST(ImageFormats, ATiffOfInks) {
    const TiffKind kind{.width = 1, .height = 1, .samples = 4, .photometric = PHOTOMETRIC_SEPARATED};
    const Result<Texture> read = read_image(test::tiff_of(kind, {255, 0, 0, 0}));
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->texels[0], (Pixel{0, 255, 255, 255}));
}

TEST(ImageFormats, SixteenBitsAreLinearWhereTheTiffSaysSo) {
    TiffKind kind = kind_of(3);
    kind.bits = 16;
    kind.is_linear = true;
    expect_picture(test::tiff_of(kind, as_samples(3, linear_wide)), "tiff, linear", 3);
}

TEST(ImageFormats, BlocksOfDds) {
    const auto first = [](const Bytes &dds) {
        const Result<Texture> read = read_image(dds);
        EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().message);
        return read.ok() ? read->texels.back() : Pixel{};
    };
    const Bytes red{0, 0xF8, 0, 0, 0, 0, 0, 0}, grey{100, 0, 0, 0, 0, 0, 0, 0};
    Bytes faint{0x44, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44}, interpolated{80, 0, 0, 0, 0, 0, 0, 0}, two = grey;
    add(faint, red);
    add(interpolated, red);
    add(two, Bytes{50, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(first(dds_of("DXT1", red)), (Pixel{255, 0, 0, 255}));
    EXPECT_EQ(first(dds_of("DX10", red, 72)), (Pixel{255, 0, 0, 255}));
    // The second colour is not smaller: the fourth index is a hole.
    EXPECT_EQ(first(dds_of("DXT1", {0, 0, 0, 0xF8, 255, 255, 255, 255}))[3], 0);
    EXPECT_EQ(first(dds_of("DXT3", faint)), (Pixel{255, 0, 0, 0x44}));
    EXPECT_EQ(first(dds_of("DXT5", interpolated)), (Pixel{255, 0, 0, 80}));
    EXPECT_EQ(first(dds_of("ATI1", grey)), (Pixel{100, 100, 100, 255}));
    EXPECT_EQ(first(dds_of("DX10", two, 83)), (Pixel{100, 50, 0, 255}));
    const Result<Texture> other = read_image(dds_of("DX10", two, 98));
    EXPECT_EQ(other.error().code, ErrorCode::unsupported_feature);
    EXPECT_NE(other.error().message.find("BC7"), std::string::npos);
}

TEST(ImageFormats, OtherFormatsAreNamed) {
    for (const auto &[start, name] : {std::pair<std::string, std::string>{"\xABKTX 20\xBB\r\n\x1A\n", "KTX2"},
                                      {"\x76\x2F\x31\x01", "OpenEXR"},
                                      {"P3\n1 1\n255\n0 0 0\n", "plain PPM"},
                                      {std::string("\0\0\0\x1C"
                                                   "ftypavif",
                                                   12),
                                       "AVIF"}}) {
        const Result<Texture> read = read_image(as_bytes(start));
        EXPECT_EQ(read.error().code, ErrorCode::unsupported_feature);
        EXPECT_NE(read.error().message.find(name), std::string::npos) << read.error().message;
    }
    const Bytes packed{'B', 'M', 0, 0, 0, 0, 0, 0, 0, 0, 54, 0, 0, 0, 40, 0,
                       0,   0,   4, 0, 0, 0, 4, 0, 0, 0, 1,  0, 8, 0, 1};
    Bytes bmp = packed;
    bmp.resize(200);
    EXPECT_EQ(read_image(bmp).error().code, ErrorCode::unsupported_feature);
    Bytes psd = psd_of(16);
    psd[39] = 1; // packed
    EXPECT_EQ(read_image(psd).error().code, ErrorCode::unsupported_feature);
}

TEST(ImageFormats, EveryTruncationIsRefused) {
    for (const auto &[name, whole] : pictures()) {
        // Behind the first frame of a GIF, and in the tags at the end of a TIFF, nothing is missed.
        const std::size_t needed = name == std::string("gif") ? whole.size() / 2 : whole.size();
        for (std::size_t size = 0; size < needed; size += 1 + size / 16)
            EXPECT_FALSE(read_image(ByteView(whole).first(size)).ok()) << name << " of " << size << " bytes";
        EXPECT_FALSE(read_image(ByteView(whole).first(needed - 1)).ok()) << name;
    }
}

TEST(ImageFormats, DamagedImagesEndInTheChild) {
    std::mt19937 random(3);
    for (const auto &[name, whole] : pictures())
        for (int i = 0; i < 40; ++i) {
            Bytes mutant = whole;
            for (int change = 0; change < 3; ++change)
                mutant[random() % std::min<std::size_t>(mutant.size(), i % 2 == 0 ? 64 : mutant.size())] =
                    static_cast<std::uint8_t>(random());
            const Result<Texture> read = read_image(mutant);
            EXPECT_TRUE(!read.ok() || read->texels.size() == std::size_t{read->width} * read->height) << name;
        }
}

// A JPEG and a PNG with Exif data, and a TIFF, lie on their side.
TEST(ImageFormats, OrientationsAreSaidAndNotApplied) {
    Bytes exif;
    add(exif, std::string_view("Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0", 32));
    Bytes jpeg = test::jpeg_of(16, 8, 3, false, Bytes(16 * 8 * 3, 90)), segment{0xFF, 0xE1, 0, 34};
    add(segment, exif);
    jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
    const Result<Texture> photograph = read_image(jpeg);
    ASSERT_TRUE(photograph.ok()) << photograph.error().message;
    EXPECT_EQ(photograph->orientation, 6);
    EXPECT_EQ(photograph->width, 16U);

    Bytes png = test::png_of(kWidth, kHeight, PNG_FORMAT_RGB, pixels_of(3).data());
    Bytes chunk{0, 0, 0, 26, 'e', 'X', 'I', 'f'};
    chunk.insert(chunk.end(), exif.begin() + 6, exif.end());
    chunk.insert(chunk.end(), 4, 0); // the CRC, which libpng does not verify of such chunks
    png.insert(png.begin() + 33, chunk.begin(), chunk.end());
    const Result<Texture> drawn = read_image(png);
    EXPECT_TRUE(!drawn.ok() || drawn->orientation == 6);

    TiffKind kind = kind_of(3);
    kind.orientation = ORIENTATION_BOTLEFT;
    expect_picture(test::tiff_of(kind, pixels_of(3)), "tiff, from below", 3);
    EXPECT_EQ(read_image(test::tiff_of(kind, pixels_of(3)))->orientation, 4);

    const auto folder = std::filesystem::path(testing::TempDir()) / ("pbm_exif_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    const auto write = [&](const char *name, const auto &bytes) {
        std::ofstream(folder / name, std::ios::binary)
            .write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    };
    write("a.jpg", jpeg);
    write("a.ply",
          std::string("ply\nformat ascii 1.0\ncomment TextureFile a.jpg\nelement vertex 3\nproperty float x\n"
                      "property float y\nproperty float z\nproperty float s\nproperty float t\nelement face 1\n"
                      "property list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n"
                      "3 0 1 2\n"));
    const Result<Surface> surface = read_surface((folder / "a.ply").string(), {});
    std::filesystem::remove_all(folder);
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    EXPECT_TRUE(std::any_of(surface->report.begin(), surface->report.end(), [](const AttributeReport &line) {
        return line.note.find("its orientation (6) is not applied") != std::string::npos;
    }));
}

} // namespace
