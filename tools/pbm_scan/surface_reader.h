// Reads a scan from a file of any known format (formats.h).
// Stability: stable.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// Maximum size in bytes of a stream or of an unpacked file: both are held in memory.
inline constexpr std::uint64_t kMaxStreamBytes = std::uint64_t{8} << 30;

// "-" is standard input; pipes and devices (/dev/stdin) are streams too. The format follows from the content, else from
// the extension, else from ReadOptions::format. Files compressed by gzip or zstd are unpacked. Messages do not contain
// the path.
//
// errors  io                   the system's own text; standard input is a terminal
//         memory               a stream of more than kMaxStreamBytes
//         bad_input            empty, damaged, or of no known format
//         unsupported_feature  another known format; the message names it and a remedy
//         and those of the readers
Result<Surface> read_surface(const std::string &path, const ReadOptions &options);

// Reads a file in memory. Uses only the extension of `path`.
Result<Surface> read_surface(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options);

// Finds a value for ReadOptions::format by the name of a format, like "ply" (formats.cpp). Null: no such name.
const ScanFormat *find_format(std::string_view name);

// Further files that reading `path` looks for, in its order: those that the scan names, there or not.
std::vector<NamedFile> further_files(const std::string &path);

} // namespace pbm::build
