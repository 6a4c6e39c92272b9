// File names: their parts, without case, as references, and the user's folders.
#pragma once

#include "system/letters.h"

#include <string>
#include <string_view>

namespace pbm {

std::string lower_case(std::string_view text);

// The extension in lower case, with its dot: ".ply" of "a.b/Scan.PLY". Empty if the name has none.
std::string lower_extension(std::string_view path);

// The name without the extension of a compressed file: "scan.ply" of "scan.ply.gz".
std::string_view uncompressed_name(std::string_view path);

// A file as a reference of RFC 3986: other bytes than letters, digits and -._~/ are escaped.
std::string uri_of(std::string_view path);

// `name` in the folder that the environment variable `variable` of the XDG base directory specification names, else in
// `fallback` of the home folder: xdg_folder("XDG_CACHE_HOME", ".cache", "pbm"). Empty if there is no home.
std::string xdg_folder(const char *variable, std::string_view fallback, std::string_view name);

} // namespace pbm
