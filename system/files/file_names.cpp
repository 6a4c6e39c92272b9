#include "system/files/file_names.h"

namespace pbm {

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char &c : lower)
        c = lower_case(c);
    return lower;
}

std::string lower_extension(std::string_view path) {
    const std::size_t dot = path.find_last_of("./");
    if (dot == std::string_view::npos || path[dot] != '.')
        return {};
    return lower_case(path.substr(dot));
}

std::string_view uncompressed_name(std::string_view path) {
    const std::string extension = lower_extension(path);
    const bool is_compressed = extension == ".gz" || extension == ".zst";
    return is_compressed ? path.substr(0, path.size() - extension.size()) : path;
}

} // namespace pbm
