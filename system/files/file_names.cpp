#include "system/files/file_names.h"

namespace pbm {

std::string lower_extension(std::string_view path) {
    const std::size_t dot = path.find_last_of("./");
    if (dot == std::string_view::npos || path[dot] != '.')
        return {};
    std::string extension(path.substr(dot));
    for (char &c : extension)
        c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return extension;
}

std::string_view uncompressed_name(std::string_view path) {
    const std::string extension = lower_extension(path);
    const bool is_compressed = extension == ".gz" || extension == ".zst";
    return is_compressed ? path.substr(0, path.size() - extension.size()) : path;
}

} // namespace pbm
