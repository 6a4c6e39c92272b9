// A folder of models that were built from scans, so that a scan is built once. Several programs may use one at a time.
#pragma once

#include "system/error.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

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
    // Evicts others, least recently used first, until all fit. Of the folder's files it removes those only that a cache
    // has named, and parts that killed builders left an hour ago. A model that is evicted while a program shows it
    // stays mapped there.
    void evict_others(const std::string &file) const;

  private:
    ModelCache(std::string folder, std::uint64_t max_bytes) : folder_(std::move(folder)), max_bytes_(max_bytes) {}

    std::string folder_;
    std::uint64_t max_bytes_;
};

// `name` in the folder that the environment variable `variable` of the XDG base directory specification names, else in
// `fallback` of the home folder: xdg_folder("XDG_CACHE_HOME", ".cache", "pbm"). Empty if there is no home.
std::string xdg_folder(const char *variable, std::string_view fallback, std::string_view name);

} // namespace pbm
