// CRC-32C (Castagnoli), the checksum of the pages of an E57 file. RFC 3720, appendix B.4
// Based on: Kounavis, Berry. A Systematic Approach to Building High Performance, Software-based, CRC Generators. 2005
#pragma once

#include <cstdint>
#include <span>

namespace pbm::build {

std::uint32_t crc32c(std::span<const std::uint8_t> bytes);

} // namespace pbm::build
