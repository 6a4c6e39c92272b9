// Pictures that illustrate the fidelity figures.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "ray_tracer.h"

#include <span>
#include <string>

namespace pbm {

// Writes a PNG file. Both functions throw if the file cannot be written.
void write_picture(const std::string &path, const Framebuffer &picture);
void write_picture(const std::string &path, std::span<const Srgb> picture, int width, int height);
// Per channel: middle grey + 8 * (picture - truth), in steps of 255.
void write_difference(const std::string &path, std::span<const Srgb> truth, const Framebuffer &picture);

} // namespace pbm
