#include "system/files/file_names.h"

#include <cstdlib>
#include <filesystem>

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

std::string uri_of(std::string_view path) {
    constexpr std::string_view kHex = "0123456789ABCDEF";
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~/";
    std::string uri = path.starts_with('/') ? "file://" : "";
    for (const char c : path) {
        const auto byte = static_cast<unsigned char>(c);
        if (kPlain.find(c) != std::string_view::npos)
            uri += c;
        else
            (uri += '%') += {kHex[byte >> 4], kHex[byte & 15]};
    }
    return uri;
}

std::string xdg_folder(const char *variable, std::string_view fallback, std::string_view name) {
    const char *const given = std::getenv(variable);
    if (given != nullptr && std::filesystem::path(given).is_absolute()) // the specification ignores relative paths
        return (std::filesystem::path(given) / name).string();
    const char *const home = std::getenv("HOME");
    return home == nullptr || *home == '\0' ? "" : (std::filesystem::path(home) / fallback / name).string();
}

} // namespace pbm
