// Gaussian splats of SPZ.
#include "unit/scan/readings.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

std::string header(std::uint32_t version, std::uint32_t splats, int degree, int streams = 0) {
    return "NGSP" + raw(version) + raw(splats) + static_cast<char>(degree) + static_cast<char>(12) + std::string(1, 0) +
           static_cast<char>(streams);
}

std::string fixed(double value) { return raw(static_cast<std::int32_t>(std::lround(value * 4096))).substr(0, 3); }

// Two splats at (1, -2, 0.25) and (-100.5, 0, 3), red and grey.
struct Splats {
    std::string places = fixed(1) + fixed(-2) + fixed(0.25) + fixed(-100.5) + fixed(0) + fixed(3);
    std::string opacities = "\xFF\x33", colours = std::string("\xFF\x00\x00\x80\x80\x80", 6);
    std::string scales = std::string(6, 'S');
};

// Versions 2 and 3, before the file is compressed.
std::string spz(std::uint32_t version, int degree = 0) {
    const Splats s;
    return header(version, 2, degree) + s.places + s.opacities + s.colours + s.scales +
           std::string(version == 3 ? 8 : 6, 'R') +
           std::string(2 * 3 * static_cast<std::size_t>(degree * (degree + 2)), 'H');
}

std::string zstd(const std::string &bytes) {
    std::string out(ZSTD_compressBound(bytes.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
    return out;
}

std::string spz4(std::size_t missing = 0) {
    const Splats s;
    const std::vector<std::string> streams{s.places.substr(missing), s.opacities, s.colours, s.scales,
                                           std::string(8, 'R')};
    std::string table, frames;
    for (const std::string &stream : streams) {
        const std::string frame = zstd(stream);
        table += raw(std::uint64_t{frame.size()}) + raw(std::uint64_t{stream.size()});
        frames += frame;
    }
    return header(4, 2, 0, 5) + raw(std::uint32_t{32}) + std::string(12, '\0') + table + frames;
}

std::string gzip(const std::string &bytes) {
    z_stream stream{};
    deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
    std::string out(bytes.size() + 100, '\0');
    stream.next_in = reinterpret_cast<Bytef *>(const_cast<char *>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef *>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

void expect_splats(const Surface &s) {
    ASSERT_EQ(s.positions.size(), 2U);
    EXPECT_EQ(s.positions[0], glm::dvec3(1, -2, 0.25));
    EXPECT_EQ(s.positions[1], glm::dvec3(-100.5, 0, 3));
    // 0.5 + 0.2820948 (1 - 0.5) / 0.15 is beyond white, 0.5 + 0.2820948 (128 / 255 - 0.5) / 0.15 is 0.5037.
    EXPECT_EQ(s.colours[0], (Rgb8{255, 0, 0}));
    EXPECT_EQ(s.colours[1], (Rgb8{128, 128, 128}));
    EXPECT_TRUE(has(note_of(s, "opacity"), "0 of 2 splats")); // 0xFF and 0x33: 1 and 0.2
    EXPECT_NEAR(s.radii[0], std::exp('S' / 16.0 - 10), 1e-6);
    EXPECT_EQ(s.two_sided.size(), 2U);
}

TEST(Spz, VersionsTwoToFourAreRead) {
    expect_splats(surface(spz(2), "scan"));
    expect_splats(surface(spz(3, 2), "scan"));
    EXPECT_TRUE(reports(surface(spz(3, 2), "scan"), "spherical harmonics", Fate::dropped));
    expect_splats(surface(spz4(), "scan"));
    const Result<Surface> s = read(spz(3), "scan", {.fields = {"opacity"}});
    ASSERT_TRUE(s);
    EXPECT_EQ(s->field_values[0][1].number, 0.2);
}

// The shortest axis is the first one, turned by a quarter about z.
TEST(Spz, DiscsFollowScalesAndRotations) {
    const std::string scales = std::string("\x50\x70\x70", 3),
                      place = fixed(1) + fixed(2) + fixed(3) + "\xFF\x80\x80\x80";
    const auto of = [&](std::uint32_t version, const std::string &rotation) {
        return surface(header(version, 1, 0) + place + scales + rotation, "scan");
    };
    const double half = std::sqrt(0.5);
    const auto byte = [](double value) { return static_cast<char>(std::lround((value + 1) * 127.5)); };
    const auto packed = static_cast<std::uint32_t>(3u << 30 | std::lround(511 * half / half)); // w is the largest
    for (const Surface &s : {of(2, std::string{byte(0), byte(0), byte(half)}), of(3, raw(packed))}) {
        EXPECT_NEAR(std::abs(s.normals[0].y), 1, 0.02);
        EXPECT_NEAR(s.radii[0], std::exp(0x70 / 16.0 - 10), 1e-5);
    }
}

TEST(Spz, VersionOneHasHalfFloats) {
    std::string file = header(1, 1, 0);
    for (const int half : {0x3C00, 0xC000, 0x3400}) // 1, -2, 0.25
        file += raw(static_cast<std::uint16_t>(half));
    file += std::string("\xFF\x80\x80\x80SSSRRR");
    EXPECT_EQ(surface(file, "scan").positions.front(), glm::dvec3(1, -2, 0.25));
}

TEST(Spz, DamageIsRefused) {
    for (const std::string &file : {spz(2), spz(3, 3), spz4()}) {
        for (std::size_t size = 4; size < file.size(); ++size)
            EXPECT_FALSE(read(file.substr(0, size), "scan").ok()) << size;
        EXPECT_TRUE(has(note_of(surface(file + "more", "scan"), "end of file"), "4 bytes"));
    }
    EXPECT_EQ(error(spz(5), "scan").code, ErrorCode::unsupported_version);
    EXPECT_TRUE(has(error(spz4(3), "scan").message, "has not the size of 2 splats"));
    std::string none = spz(2);
    none[8] = 0;
    EXPECT_TRUE(has(error(none, "scan").message, "has no splats"));
    std::string damaged = spz4();
    damaged[damaged.size() / 2] ^= 0x55;
    damaged[120] ^= 0x55;
    EXPECT_FALSE(read(damaged, "scan").ok());
}

TEST(Spz, FilesAreCompressedByGzip) {
    const std::string path = testing::TempDir() + "splats.spz", packed = gzip(spz(2));
    std::FILE *const file = std::fopen(path.c_str(), "wb");
    ASSERT_NE(file, nullptr);
    std::fwrite(packed.data(), 1, packed.size(), file);
    std::fclose(file);
    const Result<Surface> s = build::read_surface(path, ReadOptions{});
    std::remove(path.c_str());
    ASSERT_TRUE(s) << s.error().message;
    expect_splats(*s);
}

} // namespace
