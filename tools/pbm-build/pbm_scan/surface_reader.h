// Reads a scan from a file, whatever its format: PLY (ply_reader.h), OBJ, OFF and STL (mesh_reader.h).
#pragma once

#include "pbm_scan/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace pbm::build {

// The content decides where it can (PLY, OFF, STL, and all that is known but not read), the extension where it cannot
// (OBJ). Messages do not contain the path.
//
// errors  io                   the system's own text
//         bad_input            empty, damaged, or of no known format
//         unsupported_feature  another known format; the message names it and says what to do
//         and those of the readers
Result<Surface> read_surface(const std::string &path, const ReadOptions &options);

// The same for a file in memory; `path` only says its extension.
Result<Surface> read_surface(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options);

} // namespace pbm::build
