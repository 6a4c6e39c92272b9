// Images of scans as texels.
#pragma once

#include "pbm_scan/surface/surface.h"
#include "system/bytes.h"
#include "system/error.h"

#include <string>

namespace pbm::build {

// Limits of an image: texels per edge, and in all.
inline constexpr std::uint32_t kMaxTextureEdge = 32768;
inline constexpr std::uint64_t kMaxTextureTexels = std::uint64_t{1} << 28;

// Decodes an image in a child process (child_process.h), since images are untrusted and the libraries may crash.
// `are_colours`: texels become sRGB; else they are the numbers of the file, whatever it says of colours.
//
// errors  bad_input            no such image; damaged or cut short; over the limits
//         unsupported_feature  HDR, or a kind of image that is not read (image_decoder.h)
//         memory               the child reached a limit
Result<Texture> read_image(ByteView bytes, bool are_colours = true);

// The same of a file.
//
// errors  io  it cannot be opened
Result<Texture> read_image_file(const std::string &path, bool are_colours = true);

} // namespace pbm::build
