// Reads OBJ, OFF and STL files in memory. Text is read once, number by number, in double precision; a damaged or
// truncated file is refused instead of becoming a smaller model. Polygons: polygon.h.
#pragma once

#include "pbm_scan/surface/scan_format.h"
#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// A vertex whose corners have different normals or materials becomes several. Materials and images: those of the
// material files beside the OBJ (material_text.h). An OBJ truncated between two lines is detected only if its comments
// announce counts; a missing last line end is reported.
//
// errors  bad_input  damaged or truncated; with `strict` also a dropped attribute
//         too_large  more than 2^31 - 1 vertices
Result<Surface> read_obj(const ScanFile &file, const ReadOptions &options);

// The material files that an OBJ names, and the images that these name.
std::vector<NamedFile> files_of_obj(const ScanFile &file);

// Material files of an OBJ that are looked for at most: a text may name millions.
inline constexpr std::size_t kMaxFurtherFiles = 64;

// errors  as read_obj; unsupported_feature  four-dimensional OFF
Result<Surface> read_off(std::span<const std::uint8_t> bytes, const ReadOptions &options);
bool is_off(std::span<const std::uint8_t> bytes);

// Text or binary. Corners with equal coordinates are welded.
//
// errors  as read_obj
Result<Surface> read_stl(std::span<const std::uint8_t> bytes, const ReadOptions &options);
bool is_stl(std::span<const std::uint8_t> bytes);

} // namespace pbm::build
