// Whether a file is still the one that it was, without reading it.
#pragma once

#include <string>

namespace pbm {

// Device, number, size and time of modification as text: two equal ones mean the same content, unless somebody wrote as
// many bytes within one step of the file system's clock, or set the time back. Empty: there is no such file.
std::string file_state(const std::string &path);

} // namespace pbm
