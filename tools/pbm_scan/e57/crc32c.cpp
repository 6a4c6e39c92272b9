#include "pbm_scan/e57/crc32c.h"

#include <array>
#include <cstddef>
#include <cstring>

namespace pbm::build {
namespace {

constexpr std::size_t kSlices = 8;
using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

// [slice][byte]: the remainder of that byte followed by `slice` zero bytes.
constexpr Tables make_tables() {
    constexpr std::uint32_t kPolynomial = 0x82F63B78; // bits reversed
    Tables tables{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t remainder = byte;
        for (int bit = 0; bit < 8; ++bit)
            remainder = remainder >> 1 ^ ((remainder & 1) != 0 ? kPolynomial : 0);
        tables[0][byte] = remainder;
    }
    for (std::size_t slice = 1; slice < kSlices; ++slice)
        for (std::size_t byte = 0; byte < 256; ++byte) {
            const std::uint32_t before = tables[slice - 1][byte];
            tables[slice][byte] = before >> 8 ^ tables[0][before & 255];
        }
    return tables;
}

constexpr Tables kTables = make_tables();

} // namespace

std::uint32_t crc32c(std::span<const std::uint8_t> bytes) {
    std::uint32_t crc = 0xffffffff;
    while (bytes.size() >= 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data(), sizeof(word));
        word ^= crc;
        crc = 0;
        for (std::size_t i = 0; i < 8; ++i)
            crc ^= kTables[7 - i][word >> (8 * i) & 255];
        bytes = bytes.subspan(8);
    }
    for (const std::uint8_t byte : bytes)
        crc = crc >> 8 ^ kTables[0][(crc ^ byte) & 255];
    return ~crc;
}

} // namespace pbm::build
