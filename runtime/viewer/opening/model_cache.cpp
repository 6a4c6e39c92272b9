#include "viewer/opening/model_cache.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/reading/reader.h"
#include "system/files/descriptor.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "scan-", kExtension = ".pbvg";
constexpr std::size_t kDigits = 16;
constexpr std::chrono::hours kLeftBehind{1};

// Path, size and modification time.
Result<std::string> identity(const std::string &path) {
    std::error_code error;
    const fs::path full = fs::canonical(path, error);
    const auto size = error ? 0 : fs::file_size(full, error);
    const auto time = error ? fs::file_time_type() : fs::last_write_time(full, error);
    if (error)
        return io_error("cannot open", error.value());
    return full.string() + '\0' + std::to_string(size) + '\0' + std::to_string(time.time_since_epoch().count()) + '\0';
}

enum class Kind { model, part, other };

// What a file of the folder is by its name: scan-0123456789abcdef.pbvg, or the same and more while it is written.
Kind kind_of(std::string_view name) {
    constexpr std::string_view kHex = "0123456789abcdef";
    const std::size_t size = kPrefix.size() + kDigits + kExtension.size();
    if (!name.starts_with(kPrefix) || name.size() < size ||
        name.substr(kPrefix.size(), kDigits).find_first_not_of(kHex) != std::string_view::npos ||
        name.substr(kPrefix.size() + kDigits, kExtension.size()) != kExtension)
        return Kind::other;
    return name.size() == size ? Kind::model : Kind::part;
}

struct CachedFile {
    fs::path path;
    std::uint64_t size;
    fs::file_time_type used;
};

} // namespace

Result<ModelCache> ModelCache::open(const std::string &folder, std::uint64_t max_bytes) {
    std::error_code error;
    const bool created = fs::create_directories(folder, error);
    if (error)
        return io_error("cannot create the folder", error.value());
    if (created)
        fs::permissions(folder, fs::perms::owner_all, error); // as the XDG specification asks
    return ModelCache(folder, max_bytes);
}

Result<std::string> ModelCache::file_for(std::span<const std::string> sources, std::string_view options) const {
    std::string text(options);
    for (const std::string &source : sources) {
        const auto key = identity(source);
        if (!key)
            return key.error();
        text += *key;
    }
    std::string digits(kDigits, '0');
    std::snprintf(
        digits.data(), digits.size() + 1, "%016llx",
        static_cast<unsigned long long>(hash64({reinterpret_cast<const std::uint8_t *>(text.data()), text.size()})));
    return (fs::path(folder_) / (std::string(kPrefix) + digits + std::string(kExtension))).string();
}

bool ModelCache::use(const std::string &file) {
    const auto mapped = MappedFile::open(file);
    if (!mapped || !Reader::open(mapped->bytes()))
        return false;
    std::error_code ignored; // in a folder of someone else
    fs::last_write_time(file, fs::file_time_type::clock::now(), ignored);
    return true;
}

void ModelCache::evict_others(const std::string &file) const {
    std::error_code error;
    std::vector<CachedFile> models;
    std::uint64_t bytes = 0;
    const auto now = fs::file_time_type::clock::now();
    for (fs::directory_iterator each(folder_, error), end; !error && each != end; each.increment(error)) {
        std::error_code gone; // another program may evict at the same time
        const Kind kind = kind_of(each->path().filename().string());
        const CachedFile found{each->path(), each->file_size(gone), each->last_write_time(gone)};
        if (kind == Kind::other || gone)
            continue;
        if (kind == Kind::part && now - found.used > kLeftBehind) {
            fs::remove(found.path, gone);
            continue;
        }
        bytes += found.size;
        if (kind == Kind::model && found.path != fs::path(file))
            models.push_back(found);
    }
    std::sort(models.begin(), models.end(), [](const auto &a, const auto &b) { return a.used < b.used; });
    for (const CachedFile &oldest : models) {
        if (bytes <= max_bytes_)
            return;
        if (fs::remove(oldest.path, error) || !error)
            bytes -= oldest.size;
    }
}

std::string xdg_folder(const char *variable, std::string_view fallback, std::string_view name) {
    const char *const given = std::getenv(variable);
    if (given != nullptr && fs::path(given).is_absolute()) // the specification ignores relative paths
        return (fs::path(given) / name).string();
    const char *const home = std::getenv("HOME");
    return home == nullptr || *home == '\0' ? "" : (fs::path(home) / fallback / name).string();
}

} // namespace pbm
