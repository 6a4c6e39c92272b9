#include "system/files/cache_folder.h"

#include "system/files/descriptor.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <vector>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "scan-", kExtension = ".pbvg";
constexpr std::chrono::hours kLeftBehind{1};

enum class Kind { model, part, other };

// What a file of the folder is by its name: scan-0123456789abcdef.pbvg, or the same and more while it is written.
Kind kind_of(std::string_view name) {
    constexpr std::string_view kHex = "0123456789abcdef";
    constexpr std::size_t kMinDigits = 16;
    if (!name.starts_with(kPrefix))
        return Kind::other;
    name.remove_prefix(kPrefix.size());
    const std::size_t digits = std::min(name.find_first_not_of(kHex), name.size());
    if (digits < kMinDigits || !name.substr(digits).starts_with(kExtension))
        return Kind::other;
    return name.size() == digits + kExtension.size() ? Kind::model : Kind::part;
}

struct CachedFile {
    fs::path path;
    std::uint64_t size;
    fs::file_time_type used;
};

} // namespace

Result<CacheFolder> CacheFolder::open(const std::string &folder, std::uint64_t max_bytes) {
    std::error_code error;
    const bool created = fs::create_directories(folder, error);
    if (error)
        return io_error("cannot create the folder", error.value());
    if (created)
        fs::permissions(folder, fs::perms::owner_all, error); // as the XDG specification asks
    return CacheFolder(folder, max_bytes);
}

std::string CacheFolder::file_of(std::string_view key) const {
    return (fs::path(folder_) / std::string(kPrefix).append(key).append(kExtension)).string();
}

void CacheFolder::mark_used(const std::string &file) {
    std::error_code ignored; // in a folder of someone else
    fs::last_write_time(file, fs::file_time_type::clock::now(), ignored);
}

void CacheFolder::evict_others(const std::string &file) const {
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

} // namespace pbm
