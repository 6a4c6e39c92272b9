// Pictures that a viewer saves on request.
#pragma once

#include "pbm_format/error.h"
#include "pbm_render/framebuffer.h"

#include <filesystem>
#include <string>

namespace pbm {

// Writes NAME-1.png into `folder`, or NAME-2.png and so on: the first number that is not taken, so that nothing is ever
// overwritten. Returns the path.
Result<std::string> save_picture(const std::filesystem::path &folder, const std::string &name,
                                 const Framebuffer &picture);

} // namespace pbm
