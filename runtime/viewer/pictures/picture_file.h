// Picture files: the format that a name asks for, and pictures saved under a new name.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

#include <filesystem>
#include <string>

namespace pbm {

enum class PictureForm { png, bmp, jpeg, exr };

// The format of the name's extension, in lower or upper case; PNG without one.
//
// errors  usage  another extension
Result<PictureForm> picture_form(const std::string &name);

// `form` is not exr, whose pictures are PictureLayers.
//
// errors  as encode_png, encode_bmp and encode_jpeg
Result<Bytes> encode_picture(const Framebuffer &picture, PictureForm form, int threads = 1);

// Notes dots per inch in a file of this form; not in .exr.
void set_dpi(int dpi, PictureForm form, Bytes &file);

// Writes `name`-N`extension` into `folder` with the first free number N from 1; overwrites no file. Returns the path.
//
// errors  io
Result<std::string> save_numbered(const std::filesystem::path &folder, const std::string &name,
                                  const std::string &extension, ByteView bytes);
// The same for a picture, as PNG.
Result<std::string> save_picture(const std::filesystem::path &folder, const std::string &name,
                                 const Framebuffer &picture);

} // namespace pbm
