// Pictures as files: which form a name asks for, and those that a viewer saves on request.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

#include <filesystem>
#include <string>

namespace pbm {

enum class PictureForm { png, bmp };

// What the name's extension asks for, in small or large letters; PNG without one.
//
// errors  usage  another extension
Result<PictureForm> picture_form(const std::string &name);

// errors  as encode_png and encode_bmp
Result<Bytes> encode_picture(const Framebuffer &picture, PictureForm form, int threads = 1);

// Writes NAME-1.png into `folder`, or NAME-2.png and so on: the first number that is not taken, so that nothing is ever
// overwritten. Returns the path.
Result<std::string> save_picture(const std::filesystem::path &folder, const std::string &name,
                                 const Framebuffer &picture);

} // namespace pbm
