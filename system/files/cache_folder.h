// A folder of models that can be built again, so that each is built once. Several programs may use one at a time.
#pragma once

#include "system/error.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace pbm {

class CacheFolder {
  public:
    // Creates the folder if it is missing.
    //
    // errors  io  the folder cannot be created
    static Result<CacheFolder> open(const std::string &folder, std::uint64_t max_bytes);

    // The file of a key, which is 16 or more hexadecimal digits. It need not exist. Replace it atomically
    // (file_replacement.h).
    std::string file_of(std::string_view key) const;
    // Makes `file` the most recently used, by its time of access: who shows a model takes one whose time of
    // modification changes for a file that is overwritten.
    static void mark_used(const std::string &file);
    // Evicts others, least recently used first, until all fit. Of the folder's files it removes those only that a cache
    // has named, and parts that killed programs left an hour ago. A model that is evicted while a program has it open
    // stays there.
    void evict_others(const std::string &file) const;

  private:
    CacheFolder(std::string folder, std::uint64_t max_bytes) : folder_(std::move(folder)), max_bytes_(max_bytes) {}

    std::string folder_;
    std::uint64_t max_bytes_;
};

} // namespace pbm
