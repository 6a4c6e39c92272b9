#include "unit/scan/ply_files.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace pbm::test;
using pbm::Error;
using pbm::ErrorCode;
using pbm::Result;
using pbm::build::ReadOptions;
using pbm::build::Surface;
using Colour = std::array<std::uint8_t, 3>;

TEST(PlyDamage, EveryTruncationOfABinaryFileIsRefused) {
    for (const bool big_endian : {false, true}) {
        const std::string whole = binary_square(big_endian);
        for (std::size_t size = 0; size < whole.size(); ++size) {
            const Error e = error(whole.substr(0, size));
            EXPECT_EQ(e.code, ErrorCode::bad_input) << size;
            EXPECT_LE(e.offset, size);
            EXPECT_FALSE(has(e.message, "\n"));
        }
    }
}

TEST(PlyDamage, EveryTruncationOfAnAsciiFileIsRefusedDownToTheLastNumber) {
    const std::size_t last_number = kTriangle.size() - 2; // "2\n": without the line end the file is complete
    for (std::size_t size = 0; size <= last_number; ++size)
        EXPECT_EQ(error(kTriangle.substr(0, size)).code, ErrorCode::bad_input) << size;
    EXPECT_TRUE(read(kTriangle.substr(0, last_number + 1)).ok());
}

TEST(PlyDamage, CountsThatLieAreRefusedBeforeAnythingIsAllocated) {
    for (const char *count : {"4", "100", "4294967295", "18446744073709551615"}) {
        const Error e = error(replaced(kTriangle, "element vertex 3", std::string("element vertex ") + count));
        EXPECT_EQ(e.code, ErrorCode::bad_input) << count;
        EXPECT_EQ(error(replaced(binary_square(false), "element face 2", std::string("element face ") + count)).code,
                  ErrorCode::bad_input);
    }
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex 99999999999999999999")).message, "impossible count"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex -1")).message, "impossible count"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex 3.5")).message, "impossible count"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex")).message, "expected"));
    EXPECT_EQ(error(replaced(kTriangle, "vertex 3", "vertex 0")).code, ErrorCode::bad_input);
}

TEST(PlyDamage, AListThatLiesAboutItsLengthIsRefused) {
    EXPECT_EQ(error(replaced(kTriangle, "3 0 1 2\n", "200 0 1 2\n")).code, ErrorCode::bad_input);
    EXPECT_EQ(error(replaced(replaced(kTriangle, "uchar int", "int int"), "3 0 1 2\n", "-3 0 1 2\n")).code,
              ErrorCode::bad_input);
    EXPECT_EQ(error(replaced(replaced(kTriangle, "uchar int", "float int"), "3 0 1 2\n", "2.5 0 1 2\n")).code,
              ErrorCode::bad_input);
    EXPECT_EQ(surface(replaced(kTriangle, "uchar int", "float int")).triangles.size(), 1U);
    std::string binary = binary_square(false);
    binary[binary.size() - 13] = '\xff';
    EXPECT_EQ(error(binary).code, ErrorCode::bad_input);
}

TEST(PlyDamage, AnIndexOutOfRangeNamesElementRowAndPlace) {
    for (const char *bad : {"3 0 1 3\n", "3 0 -1 2\n", "3 0 1 99999999\n"}) {
        const Error e = error(replaced(kTriangle, "3 0 1 2\n", bad));
        EXPECT_EQ(e.code, ErrorCode::bad_input);
        EXPECT_TRUE(has(e.message, "line 13: face 0, vertex_indices: vertex index")) << e.message;
    }
    EXPECT_EQ(error(replaced(kTriangle, "3 0 1 2\n", "3 0 1 3\n")).offset, kTriangle.size() - 2);
    std::string binary = binary_square(false);
    binary[binary.size() - 4] = 4;
    EXPECT_EQ(error(binary).offset, binary.size() - 4);
    EXPECT_TRUE(has(error(binary).message, "face 1, vertex_indices: vertex index 4"));
}

TEST(PlyDamage, MessagesAreOneLineWhateverTheNames) {
    const std::string cr =
        replaced(replaced(kTriangle, "property float y", "property float y\nproperty float \nu\x01"), "\n", "\r");
    std::string file = replaced(cr, "\rproperty float \r", "\rproperty float \n");
    EXPECT_FALSE(has(error(file).message, "\n")) << error(file).message;
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "200 0 1 2\n")).message, "a list of 200 entries"));
}

std::string other_order(const std::string &file) {
    return has(file, "binary_little") ? replaced(file, "binary_little_endian", "binary_big_endian")
                                      : replaced(file, "binary_big_endian", "binary_little_endian");
}

TEST(PlyDamage, CoordinatesShowTheWrongByteOrder) {
    for (const bool big_endian : {false, true}) {
        const Error e = error(other_order(binary_square(big_endian)));
        EXPECT_EQ(e.code, ErrorCode::bad_input);
        EXPECT_TRUE(has(e.message, "vertex 0, z: reads 4.")) << e.message;
        EXPECT_TRUE(has(e.message, big_endian ? "make it 'format binary_big_endian 1.0'"
                                              : "make it 'format binary_little_endian 1.0'"))
            << e.message;
    }
    // Points with realistic coordinates, as float and as double.
    for (const bool wide : {false, true}) {
        std::mt19937 random(4);
        std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex 1000\n" +
                           (wide ? replaced(kXyz, "float", "double") : kXyz) + "end_header\n";
        for (int i = 0; i < 3000; ++i) {
            const double value = static_cast<double>(random()) * 1e-7;
            if (wide)
                put(file, value, false);
            else
                put(file, static_cast<float>(value), false);
        }
        EXPECT_TRUE(read(file).ok());
        EXPECT_TRUE(has(error(other_order(file)).message, "wrong byte order"));
    }
}

TEST(PlyDamage, StrangeCoordinatesOfTheRightByteOrderAreKept) {
    const float nan = std::nanf(""), tiny = 1e-40F;
    for (const std::vector<float> &values : {std::vector<float>{0, 0, 0, 1e30F, 1e30F, 0, -1e30F, 1e30F, 0},
                                             {nan, nan, nan, 1, 2, 3, nan, nan, nan},
                                             {1, 2, 3e-17F, 4, 5, -2e-17F, 6, 7.5F, 1e-17F},
                                             {0, 0, 0, 0, 0, 0, 0, 0, 0},
                                             {1e-20F, 3e-20F, 7e-21F, tiny, tiny, tiny, 0, 0, 3e-20F}}) {
        std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n" + kXyz + "end_header\n";
        for (const float value : values)
            put(file, value, false);
        EXPECT_TRUE(read(file).ok()) << values[3];
    }
}

TEST(PlyDamage, CountsAndIndicesShowTheWrongByteOrder) {
    std::string file = "ply\nformat binary_big_endian 1.0\nelement face 1\nproperty list int int vertex_indices\n"
                       "element vertex 3\n" +
                       kXyz + "end_header\n";
    std::string counted_wrong = file, index_wrong = replaced(file, "list int int", "list uchar int");
    for (const std::int32_t value : {3, 0, 1, 2})
        put(counted_wrong, value, false);
    index_wrong += '\3';
    for (const std::int32_t value : {0, 1, 2})
        put(index_wrong, value, false);
    for (std::string *bytes : {&counted_wrong, &index_wrong})
        for (const float value : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F})
            put(*bytes, value, false);
    for (const std::string &bytes : {counted_wrong, index_wrong}) {
        EXPECT_TRUE(has(error(bytes).message, "'format binary_big_endian 1.0' is probably wrong"))
            << error(bytes).message;
        EXPECT_TRUE(read(other_order(bytes)).ok());
    }
}

TEST(PlyDamage, CoordinatesThatMakeSenseClearTheByteOrder) {
    std::string file = binary_square(false);
    const std::size_t corner = file.size() - 4;
    file.replace(corner, 4, std::string("\0\0\0\1", 4)); // 1 in the other byte order
    EXPECT_TRUE(has(error(file).message, "vertex index 16777216, but there are 4 vertices;")) << error(file).message;
}

TEST(PlyDamage, TextInABinaryBodyAndBinaryInATextBodyAreNamed) {
    std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex 6\n" + kXyz + "end_header\n";
    for (int i = 0; i < 6; ++i)
        text += "0.123456 0.234567 1e-05\n";
    EXPECT_TRUE(has(error(text).message, "make it 'format ascii 1.0'")) << error(text).message;
    EXPECT_TRUE(read(replaced(text, "binary_little_endian", "ascii")).ok());
    const Error e = error(replaced(binary_square(false), "binary_little_endian", "ascii"));
    EXPECT_TRUE(has(e.message, "is the body binary?")) << e.message;
}

TEST(PlyDamage, CarriageReturnsThatATransferTookOutAreNamed) {
    std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex 4000\n" +
                       replaced(kXyz, "float", "uchar") +
                       "element face 200\nproperty list uchar ushort vertex_indices\nend_header\n";
    std::mt19937 random(2);
    for (int i = 0; i < 12000; ++i) // many LFs and some CRs, so that CR LF pairs occur
        file += random() % 3 == 0 ? '\n' : random() % 30 == 0 ? '\r' : static_cast<char>(random());
    for (int i = 0; i < 200; ++i) {
        file += '\3';
        for (int k = 0; k < 3; ++k)
            put(file, static_cast<std::uint16_t>(3 * (i % 100) + k), false);
    }
    ASSERT_TRUE(read(file).ok());
    const std::size_t body = file.find("end_header\n") + 11;
    const Error e = error(file.substr(0, body) + replaced(file.substr(body), "\r\n", "\n"));
    EXPECT_EQ(e.code, ErrorCode::bad_input);
    EXPECT_TRUE(has(e.message, "taken CRs out")) << e.message;
    EXPECT_FALSE(has(error(file.substr(0, file.size() - 1)).message, "taken CRs out"));
}

TEST(PlyDamage, ACommentInTheBodyIsNoRow) {
    EXPECT_TRUE(has(error(replaced(kTriangle, "1 0 0\n", "comment half way\n1 0 0\n")).message,
                    "line 11: vertex 1, x: 'comment' is not a number"));
    EXPECT_TRUE(has(report(surface(kTriangle + "comment the end\n"), "end of file").note, "16 bytes"));
}

TEST(PlyDamage, TextThatIsNoNumberIsRefused) {
    for (const char *bad : {"x", "0,5", "1.2.3", "+-1", "0x10", "--1", "1e", ".", "-", "+", "1e5e5", "\x80\x81"}) {
        const Error e = error(replaced(kTriangle, "1 0 0\n", std::string("1 ") + bad + " 0\n"));
        EXPECT_TRUE(has(e.message, "line 11: vertex 1, y: ")) << bad << ": " << e.message;
    }
    EXPECT_TRUE(has(error(replaced(kTriangle, "1 0 0\n", "1 0,5 0\n")).message, "point"));
    EXPECT_EQ(surface(replaced(kTriangle, "1 0 0\n", "+1 -.5 5.\n")).positions[1], glm::dvec3(1, -0.5, 5));
}

TEST(PlyDamage, AValueMustFitItsType) {
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "256 0 1 2\n")).message, "'256' does not fit type uchar"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "3 0 1.5 2\n")).message, "'1.5' does not fit type int"));
}

TEST(PlyDamage, ARowMustEndWithItsLine) {
    const Error e = error(replaced(kTriangle, "1 0 0\n", "1 0 0 7\n"));
    EXPECT_TRUE(has(e.message, "line 11: vertex 1: more values")) << e.message;
    EXPECT_EQ(surface(replaced(kTriangle, "1 0 0\n", "1 0\n0\n")).positions.size(), 3U);
}

TEST(PlyDamage, TrailingBytesAreReported) {
    EXPECT_EQ(report(surface(kTriangle + "\n \r\n"), "end of file").note, "");
    EXPECT_TRUE(has(report(surface(kTriangle + "more\n"), "end of file").note, "5 bytes"));
    EXPECT_TRUE(has(report(surface(binary_square(true) + "abc"), "end of file").note, "3 bytes"));
}

TEST(PlyDamage, TranslatedLineEndsOfABinaryBodyAreNamed) {
    EXPECT_TRUE(has(error(replaced(binary_square(false), "\n", "\r\n")).message, "binary mode"));
}

TEST(PlyDamage, StrictRefusesWhatWouldBeDropped) {
    ReadOptions strict;
    strict.strict = true;
    EXPECT_TRUE(read(kTriangle, strict).ok());
    EXPECT_TRUE(has(error(kTriangle + "more\n", strict).message, "--strict: end of file"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "1 0 0\n", "1 nan 0\n"), strict).message, "not finite"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "3 0 1 1\n"), strict).message, "degenerate"));
}

TEST(PlyDamage, FlippedBitsNeverGiveAnIndexOutOfRange) {
    std::mt19937 random(1);
    for (const std::string &whole : {kTriangle, binary_square(false), binary_square(true),
                                     kMaterials + "0 0 0 1\n1 1 1 0\n"
                                                  "0 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 0\n"})
        for (int i = 0; i < 4000; ++i) {
            std::string file = whole;
            for (int flips = 0; flips <= i % 3; ++flips)
                file[random() % file.size()] ^= static_cast<char>(1U << (random() % 8));
            const Result<Surface> result = read(file);
            if (!result) {
                EXPECT_FALSE(has(result.error().message, "\n"));
                continue;
            }
            for (const glm::uvec3 &t : result->triangles)
                EXPECT_TRUE(t.x < result->positions.size() && t.y < result->positions.size() &&
                            t.z < result->positions.size());
        }
}

} // namespace
