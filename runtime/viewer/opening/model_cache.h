// The models that a viewer has had built from scans, by path and state of these.
#pragma once

#include "system/error.h"
#include "system/files/cache_folder.h"

#include <chrono>
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

    // The files for what a program makes of a scan; they need not exist. Their names are hashes of full path and
    // file_state of each source, so a scan that changes, or a newer program, has other files.
    struct Names {
        std::string settled;     // made of sources that cannot change without a trace
        std::string young;       // made when one of them had just changed: its content is to be compared at each use
        bool is_settled = false; // whether the sources are so now
    };
    // `sources`: the scan, the program, and whatever else the model depends on; `options`: text that it depends on.
    //
    // errors  io  one of them cannot be examined
    Result<Names> names_for(std::span<const std::string> sources, std::string_view options,
                            std::chrono::system_clock::time_point now) const;

    // Makes `file` the most recently used. Returns false if there is no such file, or a damaged one.
    static bool use(const std::string &file);
    void evict_others(const std::string &file) const { folder_.evict_others(file); }

  private:
    explicit ModelCache(CacheFolder folder) : folder_(std::move(folder)) {}

    CacheFolder folder_;
};

} // namespace pbm
