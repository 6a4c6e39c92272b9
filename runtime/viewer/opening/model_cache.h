// The models that a viewer has had built from scans, by path, size and time of these.
#pragma once

#include "system/error.h"
#include "system/files/cache_folder.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace pbm {

class ModelCache {
  public:
    // Least recently used models are evicted beyond this size.
    static constexpr std::uint64_t kMaxBytes = std::uint64_t{4} << 30;

    // Creates the folder if it is missing.
    //
    // errors  io  the folder cannot be created
    static Result<ModelCache> open(const std::string &folder, std::uint64_t max_bytes = kMaxBytes);

    // The file for what a program makes of a scan; `sources`: the scan, the program, and whatever else the model
    // depends on; `options`: text that it depends on. Its name is a hash of full path, size and modification time of
    // each, so a scan that changes, or a newer program, gets another file. The file need not exist.
    //
    // errors  io  one of them cannot be examined
    Result<std::string> file_for(std::span<const std::string> sources, std::string_view options = {}) const;

    // Makes `file` the most recently used. Returns false if there is no such file, or a damaged one.
    static bool use(const std::string &file);
    void evict_others(const std::string &file) const { folder_.evict_others(file); }

  private:
    explicit ModelCache(CacheFolder folder) : folder_(std::move(folder)) {}

    CacheFolder folder_;
};

} // namespace pbm
