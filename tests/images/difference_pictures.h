// Pictures for people who ask what figures mean.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "ray_tracer.h"

#include <span>
#include <string>

namespace pbm {

// PNG files. All throw if the file cannot be written.
void write_picture(const std::string &path, const Framebuffer &picture);
void write_picture(const std::string &path, std::span<const Srgb> picture, int width, int height);
// Grey where both are equal; a channel that is too light by one step of 255 is eight steps lighter.
void write_difference(const std::string &path, std::span<const Srgb> truth, const Framebuffer &picture);

} // namespace pbm
