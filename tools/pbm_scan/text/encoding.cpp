#include "pbm_scan/text/encoding.h"

#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <array>
#include <optional>

namespace pbm::build {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 3> kUtf8Mark{0xEF, 0xBB, 0xBF};
constexpr std::array<std::uint8_t, 2> kLittleEndian{0xFF, 0xFE}, kBigEndian{0xFE, 0xFF};
constexpr std::array<std::uint8_t, 4> kUtf32Little{0xFF, 0xFE, 0, 0}, kUtf32Big{0, 0, 0xFE, 0xFF};

bool begins_with(Bytes file, Bytes mark) {
    return file.size() >= mark.size() && std::equal(mark.begin(), mark.end(), file.begin());
}

template <class Text> void append(std::uint32_t character, Text &to) {
    const auto add = [&](std::uint32_t byte) { to.push_back(static_cast<typename Text::value_type>(byte)); };
    const auto add_rest = [&](int shift) { add(0x80 | (character >> shift & 0x3F)); };
    if (character < 0x80)
        return add(character);
    if (character < 0x800)
        return add(0xC0 | character >> 6), add_rest(0);
    if (character < 0x10000)
        return add(0xE0 | character >> 12), add_rest(6), add_rest(0);
    add(0xF0 | character >> 18), add_rest(12), add_rest(6), add_rest(0);
}

// `units`: what follows the mark.
Result<std::vector<std::uint8_t>> decode(Bytes units, bool big_endian) {
    const auto unit = [&](std::size_t at) -> std::optional<std::uint32_t> {
        if (units.size() - at < 2)
            return std::nullopt;
        return big_endian ? units[at] << 8 | units[at + 1] : units[at + 1] << 8 | units[at];
    };
    std::vector<std::uint8_t> text;
    text.reserve(units.size() / 2);
    for (std::size_t at = 0; at < units.size();) {
        const auto broken = [&] { return bad_input("text in UTF-16 with half a character; convert it anew", 2 + at); };
        const auto first = unit(at);
        if (!first || *first >> 10 == 0x37)
            return broken();
        std::uint32_t character = *first;
        if (*first >> 10 == 0x36) { // the first of two
            const auto second = at + 2 < units.size() ? unit(at + 2) : std::nullopt;
            if (!second || *second >> 10 != 0x37)
                return broken();
            character = 0x10000 + ((*first & 0x3FF) << 10 | (*second & 0x3FF));
        }
        append(character, text);
        at += character < 0x10000 ? 2 : 4;
    }
    return text;
}

} // namespace

void append_utf8(char32_t character, std::string &text) { append(character, text); }

std::uint64_t Utf8Text::offset_in_file(std::uint64_t at) const {
    if (decoded.empty())
        return at + skipped;
    std::uint64_t offset = skipped;
    for (const std::uint8_t byte : bytes.first(std::min<std::uint64_t>(at, bytes.size())))
        offset += byte >= 0xF0 ? 4U : byte >= 0xC0 || byte < 0x80 ? 2U : 0U; // by the first byte of each character
    return offset;
}

Result<Utf8Text> as_utf8(Bytes file) {
    if (begins_with(file, kUtf32Little) || begins_with(file, kUtf32Big))
        return bad_input("text in UTF-32; convert it, as with iconv -f UTF-32 -t UTF-8");
    if (begins_with(file, kUtf8Mark))
        return Utf8Text{.bytes = file.subspan(kUtf8Mark.size()), .decoded = {}, .skipped = kUtf8Mark.size()};
    const bool big_endian = begins_with(file, kBigEndian);
    if (!big_endian && !begins_with(file, kLittleEndian))
        return Utf8Text{.bytes = file, .decoded = {}};
    auto decoded = decode(file.subspan(2), big_endian);
    if (!decoded)
        return decoded.error();
    Utf8Text text{.bytes = {}, .decoded = std::move(*decoded), .skipped = 2};
    text.bytes = text.decoded;
    return text;
}

} // namespace pbm::build
