// What the command lines of the viewer's programs have in common. Knows nothing of CLI11, which is slow to compile.
#pragma once

#include "pbm_format/error.h"
#include "pbm_render/framebuffer.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace pbm {

// Arguments after the program's name with the dissertation's single-dash switches replaced by today's options and a
// lone
// `--json` by `--json=-`, so that it does not take the next argument. A switch whose effect this program does not have
// yet is ErrorCode::usage.
Result<std::vector<std::string>> modern_arguments(int argc, const char *const *argv);

// "W,H" or "WxH", each 1..kMaxPictureEdge.
Result<glm::ivec2> parse_resolution(const std::string &text);
// "x,y,z": finite numbers in the C locale's spelling.
Result<glm::dvec3> parse_vector(const std::string &text);
// "r,g,b", each 0..1, sRGB.
Result<Rgba8> parse_colour(const std::string &text);
// Bytes: a whole number and an optional k, M, G or T (powers of 1024).
Result<std::uint64_t> parse_bytes(const std::string &text);

// What a user can do about an error, starting with "; ", or nothing.
std::string_view advice(ErrorCode code);
// "FILE: message; advice (offset N)"
std::string describe(const std::string &file, const Error &error);

} // namespace pbm
