// Text of other programs: byte order marks, UTF-16; offsets refer to the file as it is.
#include "pbm_scan/text/encoding.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace pbm::build {
namespace {

std::vector<std::uint8_t> file_of(std::string_view text) { return {text.begin(), text.end()}; }

// With the byte order mark of the encoding.
std::vector<std::uint8_t> utf16(std::u16string_view text, bool big_endian) {
    std::vector<std::uint8_t> file;
    for (const char16_t unit : std::u16string(1, u'\uFEFF') + std::u16string(text))
        for (const int shift : big_endian ? std::array{8, 0} : std::array{0, 8})
            file.push_back(static_cast<std::uint8_t>(unit >> shift));
    return file;
}

std::string text_of(const Utf8Text &text) { return {text.bytes.begin(), text.bytes.end()}; }

TEST(Encoding, FilesWithoutAMarkAreReturnedAsTheyAre) {
    for (const std::string_view text : {"", "\xEF\xBB", "\xFF", "ply\n", "\xFFplain\xFE"}) {
        const auto file = file_of(text);
        const auto read = as_utf8(file);
        ASSERT_TRUE(read);
        EXPECT_EQ(read->bytes.data(), file.data());
        EXPECT_EQ(read->bytes.size(), file.size());
        EXPECT_EQ(read->offset_in_file(7), 7U);
    }
}

TEST(Encoding, TheMarkOfUtf8IsSkipped) {
    const auto file = file_of("\xEF\xBB\xBFply");
    const auto read = as_utf8(file);
    ASSERT_TRUE(read);
    EXPECT_EQ(text_of(*read), "ply");
    EXPECT_EQ(read->offset_in_file(0), 3U);
    EXPECT_EQ(read->offset_in_file(2), 5U);
}

TEST(Encoding, Utf16IsDecodedInBothByteOrders) {
    for (const bool big_endian : {false, true}) {
        const auto file = utf16(u"v 1\nä€\U0001F600z", big_endian);
        const auto read = as_utf8(file);
        ASSERT_TRUE(read);
        EXPECT_EQ(text_of(*read), "v 1\n\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80z");
        EXPECT_EQ(read->offset_in_file(0), 2U);
        EXPECT_EQ(read->offset_in_file(4), 10U);          // ä
        EXPECT_EQ(read->offset_in_file(6), 12U);          // €
        EXPECT_EQ(read->offset_in_file(9), 14U);          // of two units
        EXPECT_EQ(read->offset_in_file(13), 18U);         // z
        EXPECT_EQ(read->offset_in_file(14), file.size()); // the end
        EXPECT_EQ(read->offset_in_file(1000), file.size());
    }
}

TEST(Encoding, HalfACharacterOfUtf16IsRefusedWithItsPlace) {
    for (const bool big_endian : {false, true}) {
        for (const char16_t *text : {u"ab\xD83D", u"ab\xD83Dz", u"ab\xDE00z", u"ab\xD83D\xD83D\xDE00"}) {
            const auto read = as_utf8(utf16(text, big_endian));
            ASSERT_FALSE(read);
            EXPECT_EQ(read.error().code, ErrorCode::bad_input);
            EXPECT_EQ(read.error().offset, 6U);
        }
        auto odd = utf16(u"ab", big_endian);
        odd.push_back('c');
        const auto read = as_utf8(odd);
        ASSERT_FALSE(read);
        EXPECT_EQ(read.error().offset, 6U);
    }
}

TEST(Encoding, Utf32IsNamed) {
    for (const std::string_view mark : {std::string_view("\xFF\xFE\0\0", 4), std::string_view("\0\0\xFE\xFF", 4)}) {
        const auto read = as_utf8(file_of(mark));
        ASSERT_FALSE(read);
        EXPECT_NE(read.error().message.find("UTF-32"), std::string::npos);
    }
}

} // namespace
} // namespace pbm::build
