#include "pbm_scan/ply/ply_damage.h"

#include "pbm_scan/ply/ply_source.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

constexpr std::size_t kMaxTextLooked = 4096;

bool is_number_text(std::uint8_t c) {
    return (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.' || c == 'e' || c == 'E' ||
           ends_word(static_cast<char>(c));
}

// The value of a property of this type with its bytes swapped.
double other_order(double value, PlyScalar type) {
    if (type == PlyScalar::float32)
        return static_cast<double>(
            std::bit_cast<float>(__builtin_bswap32(std::bit_cast<std::uint32_t>(static_cast<float>(value)))));
    return std::bit_cast<double>(__builtin_bswap64(std::bit_cast<std::uint64_t>(value)));
}

bool absurd(double value) {
    constexpr double kHuge = 1e32, kTiny = 1e-12;
    const double size = std::abs(value);
    return !(size <= kHuge) || (size < kTiny && size != 0.0);
}

} // namespace

std::string_view to_string(PlyEncoding encoding) { return kEncodingNames[static_cast<std::size_t>(encoding)]; }

std::optional<Error> text_in_binary_body(std::span<const std::uint8_t> bytes, const PlyHeader &header) {
    constexpr std::size_t kNoChance = 64;
    const auto body = bytes.subspan(header.body_offset, std::min(kMaxTextLooked, bytes.size() - header.body_offset));
    if (header.encoding == PlyEncoding::ascii || body.size() < kNoChance ||
        !std::all_of(body.begin(), body.end(), is_number_text))
        return std::nullopt;
    return bad_input("the header says " + std::string(to_string(header.encoding)) +
                         " but the numbers that follow are text; make it 'format ascii 1.0' or export the scan again",
                     header.body_offset);
}

std::size_t inserted_line_ends(std::span<const std::uint8_t> bytes, const PlyHeader &header) {
    constexpr std::size_t kNoChance = 4;
    if (header.encoding == PlyEncoding::ascii)
        return 0;
    std::size_t inserted = 0;
    for (std::size_t i = header.body_offset; i < bytes.size(); ++i)
        if (bytes[i] == '\n') {
            if (i == header.body_offset || bytes[i - 1] != '\r')
                return 0;
            ++inserted;
        }
    return inserted >= kNoChance ? inserted : 0;
}

Error inserted_line_ends_error(const PlyHeader &header) {
    return bad_input("a transfer has translated the line ends of this binary file; copy it again in binary mode",
                     header.body_offset);
}

std::string body_hint(std::span<const std::uint8_t> bytes, const PlyHeader &header, std::size_t at) {
    const auto body = bytes.subspan(header.body_offset);
    if (header.encoding == PlyEncoding::ascii) {
        const auto there = bytes.subspan(std::min(at, bytes.size()), std::min(kMaxTextLooked, bytes.size() - at));
        const bool binary = std::any_of(there.begin(), there.end(), [](std::uint8_t c) {
            return c == 0x7f || (c < ' ' && !ends_word(static_cast<char>(c)));
        });
        return binary ? " (the header says ascii, but these bytes are no text: is the body binary?)" : "";
    }
    constexpr std::size_t kExpectedReturns = 64;
    constexpr double kExpectedPairs = 8.0;
    std::size_t returns = 0, feeds = 0, pairs = 0;
    for (std::size_t i = 0; i < body.size(); ++i) {
        returns += body[i] == '\r' ? 1U : 0U;
        feeds += body[i] == '\n' ? 1U : 0U;
        pairs += body[i] == '\n' && i != 0 && body[i - 1] == '\r' ? 1U : 0U;
    }
    const double by_chance =
        static_cast<double>(returns) * static_cast<double>(feeds) / static_cast<double>(body.size() + 1);
    const bool no_returns = returns == 0 && feeds >= kExpectedReturns;
    if (!no_returns && !(by_chance >= kExpectedPairs && static_cast<double>(pairs) * kExpectedPairs <= by_chance))
        return "";
    return " (hardly a CR LF is in it: a transfer in text mode has probably taken CRs out; copy it again in binary "
           "mode)";
}

std::optional<Error> wrong_byte_order(std::span<const glm::dvec3> positions, const PlyHeader &header,
                                      const PlyRoles &roles) {
    constexpr std::size_t kMaxLooked = 4096;
    const std::size_t step = std::max<std::size_t>(1, positions.size() / kMaxLooked);
    std::size_t looked = 0, absurd_here = 0, absurd_there = 0;
    std::string example;
    for (std::size_t row = 0; row < positions.size(); row += step)
        for (std::size_t axis = 0; axis < roles.position.size(); ++axis) {
            const PlyProperty &property = *roles.position[axis];
            const double value = positions[row][static_cast<int>(axis)];
            if (!is_float(property.type))
                continue;
            const double other = other_order(value, property.type);
            ++looked;
            absurd_there += absurd(other) ? 1U : 0U;
            if (!absurd(value))
                continue;
            ++absurd_here;
            if (example.empty() && !absurd(other))
                example = "vertex " + std::to_string(row) + ", " + property.name +
                          formatted(": reads %.6g, and %.6g", value, other);
        }
    if (absurd_here * 4 <= looked || absurd_there * 100 > looked)
        return std::nullopt;
    const bool little = header.encoding == PlyEncoding::little_endian;
    const std::string other_name(to_string(little ? PlyEncoding::big_endian : PlyEncoding::little_endian));
    return bad_input(example + " as " + other_name + ", and so do the other vertices: the header says " +
                         std::string(to_string(header.encoding)) + " and names the wrong byte order; make it 'format " +
                         other_name + " 1.0'",
                     header.body_offset);
}

} // namespace pbm::build
