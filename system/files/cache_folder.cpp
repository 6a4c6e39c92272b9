#include "system/files/cache_folder.h"

#include "system/files/descriptor.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>

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
    std::uint64_t size = 0;
    std::pair<std::time_t, long> used; // seconds and nanoseconds
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
    const std::array<timespec, 2> times{{{.tv_sec = 0, .tv_nsec = UTIME_NOW}, {.tv_sec = 0, .tv_nsec = UTIME_OMIT}}};
    static_cast<void>(::utimensat(AT_FDCWD, file.c_str(), times.data(), 0)); // fails in a folder of someone else
}

void CacheFolder::evict_others(const std::string &file) const {
    std::error_code error;
    std::vector<CachedFile> models;
    std::uint64_t bytes = 0;
    const std::time_t killed = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now() - kLeftBehind);
    for (fs::directory_iterator each(folder_, error), end; !error && each != end; each.increment(error)) {
        std::error_code gone; // another program may evict at the same time
        const Kind kind = kind_of(each->path().filename().string());
        struct stat found {};
        if (kind == Kind::other || ::stat(each->path().c_str(), &found) != 0 || !S_ISREG(found.st_mode))
            continue;
        if (kind == Kind::part && found.st_mtim.tv_sec < killed) {
            fs::remove(each->path(), gone);
            continue;
        }
        const auto size = static_cast<std::uint64_t>(found.st_size);
        bytes += size;
        if (kind == Kind::model && each->path() != fs::path(file))
            models.push_back({each->path(), size, {found.st_atim.tv_sec, found.st_atim.tv_nsec}});
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
