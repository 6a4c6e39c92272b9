#include "viewer/opening/model_cache.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/reading/reader.h"
#include "system/files/descriptor.h"
#include "system/files/mapped_file.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

namespace pbm {
namespace {

namespace fs = std::filesystem;

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

} // namespace

Result<ModelCache> ModelCache::open(const std::string &folder, std::uint64_t max_bytes) {
    auto opened = CacheFolder::open(folder, max_bytes);
    if (!opened)
        return opened.error();
    return ModelCache(std::move(*opened));
}

Result<std::string> ModelCache::file_for(std::span<const std::string> sources, std::string_view options) const {
    std::string text(options);
    for (const std::string &source : sources) {
        const auto key = identity(source);
        if (!key)
            return key.error();
        text += *key;
    }
    std::array<char, 17> key{};
    std::snprintf(key.data(), key.size(), "%016llx", static_cast<unsigned long long>(hash64(as_bytes(text))));
    return folder_.file_of(key.data());
}

bool ModelCache::use(const std::string &file) {
    const auto mapped = MappedFile::open(file);
    if (!mapped || !Reader::open(mapped->bytes()))
        return false;
    CacheFolder::mark_used(file);
    return true;
}

} // namespace pbm
