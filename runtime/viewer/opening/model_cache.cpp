#include "viewer/opening/model_cache.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/reading/reader.h"
#include "system/files/descriptor.h"
#include "system/files/file_state.h"
#include "system/files/mapped_file.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

namespace pbm {
namespace {

namespace fs = std::filesystem;

// Path and state.
Result<std::string> identity(const std::string &path) {
    std::error_code error;
    const fs::path full = fs::canonical(path, error);
    if (error)
        return io_error("cannot open", error.value());
    return full.string() + '\0' + file_state(full.string()) + '\0';
}

std::string hex_key(std::string_view text) {
    std::array<char, 17> key{};
    std::snprintf(key.data(), key.size(), "%016llx", static_cast<unsigned long long>(hash64(as_bytes(text))));
    return key.data();
}

} // namespace

Result<ModelCache> ModelCache::open(const std::string &folder, std::uint64_t max_bytes) {
    auto opened = CacheFolder::open(folder, max_bytes);
    if (!opened)
        return opened.error();
    return ModelCache(std::move(*opened));
}

Result<ModelCache::Names> ModelCache::names_for(std::span<const std::string> sources, std::string_view options,
                                                std::chrono::system_clock::time_point now) const {
    std::string text(options);
    bool is_settled = true;
    for (const std::string &source : sources) {
        const auto key = identity(source);
        if (!key)
            return key.error();
        text += *key;
        is_settled = is_settled && pbm::is_settled(source, now);
    }
    return Names{folder_.file_of(hex_key(text)), folder_.file_of(hex_key(text + "young")), is_settled};
}

bool ModelCache::use(const std::string &file) {
    const auto mapped = MappedFile::open(file);
    if (!mapped || !Reader::open(mapped->bytes()))
        return false;
    CacheFolder::mark_used(file);
    return true;
}

} // namespace pbm
