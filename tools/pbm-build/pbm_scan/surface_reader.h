// Reads a scan from a file, whatever its format: PLY (ply_reader.h), OBJ, OFF and STL (mesh_reader.h).
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// A stream is read to its end into memory before anything else, at most so many bytes.
inline constexpr std::uint64_t kMaxStreamBytes = std::uint64_t{8} << 30;

// "-" is standard input; a pipe or a device (/dev/stdin) is a stream too. The content decides where it can (PLY, OFF,
// STL, and all that is known but not read), the extension where it cannot (OBJ), and ReadOptions::format where there is
// no extension of a scan. Messages do not contain the path.
//
// errors  io                   the system's own text; standard input is a terminal
//         memory               a stream of more than kMaxStreamBytes
//         bad_input            empty, damaged, or of no known format
//         unsupported_feature  another known format; the message names it and says what to do
//         and those of the readers
Result<Surface> read_surface(const std::string &path, const ReadOptions &options);

// The same for a file in memory; `path` only says its extension.
Result<Surface> read_surface(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options);

// Of the material files that an OBJ names only so many, the first ones, are looked for: a text may name millions.
inline constexpr std::size_t kMaxMaterialFiles = 64;

// Names of the further files that reading `path` opens: the material files that an OBJ names and that are there.
std::vector<std::string> material_files(const std::string &path);

} // namespace pbm::build
