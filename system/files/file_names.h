// Parts of file names.
#pragma once

#include <string>
#include <string_view>

namespace pbm {

// The extension in lower case, with its dot: ".ply" of "a.b/Scan.PLY". Empty if the name has none.
std::string lower_extension(std::string_view path);

// The name without the extension of a compressed file: "scan.ply" of "scan.ply.gz".
std::string_view uncompressed_name(std::string_view path);

} // namespace pbm
