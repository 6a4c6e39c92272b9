// Reads a scan from a file of any known format: PLY (ply_reader.h), OBJ, OFF and STL (mesh_reader.h).
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// Maximum size of a stream, which is read into memory.
inline constexpr std::uint64_t kMaxStreamBytes = std::uint64_t{8} << 30;

// "-" is standard input; pipes and devices (/dev/stdin) are streams too. The format follows from the content (PLY, OFF,
// STL, and known formats that are not read), else from the extension (OBJ), else from ReadOptions::format. Messages do
// not contain the path.
//
// errors  io                   the system's own text; standard input is a terminal
//         memory               a stream of more than kMaxStreamBytes
//         bad_input            empty, damaged, or of no known format
//         unsupported_feature  another known format; the message names it and a remedy
//         and those of the readers
Result<Surface> read_surface(const std::string &path, const ReadOptions &options);

// Reads a file in memory; of `path` only the extension is used.
Result<Surface> read_surface(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options);

// Maximum number of material files of an OBJ that are opened: a text may name millions.
inline constexpr std::size_t kMaxMaterialFiles = 64;

// Further files that reading `path` opens: the existing material files that an OBJ names.
std::vector<std::string> material_files(const std::string &path);

} // namespace pbm::build
