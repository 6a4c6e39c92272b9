// A file format of scans. The table of all: formats.h.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// A scan in memory.
struct ScanFile {
    std::span<const std::uint8_t> bytes; // not empty
    std::string path{};                  // where files beside it are looked for; empty: it has none
};

struct ScanFormat {
    std::string_view name;       // as --input-format has it
    std::string_view extensions; // lower case, with dots, separated by spaces
    // Whether the first bytes are those of this format; null: they do not tell.
    bool (*recognises)(std::span<const std::uint8_t> bytes);
    // Returns a finished Surface (surface.h). Messages do not contain the path.
    Result<Surface> (*read)(const ScanFile &file, const ReadOptions &options);
    // Files that `read` looks for besides, in its order; null: none.
    std::vector<NamedFile> (*further_files)(const ScanFile &file) = nullptr;
    bool has_columns = false; // it reads ReadOptions::columns

    bool has_extension(std::string_view extension) const;
};

} // namespace pbm::build
