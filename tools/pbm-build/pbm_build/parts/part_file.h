// Parts as files, which one machine writes and another reads. They are no models, and no format for others: the
// program that reads one must be of the version that wrote it.
//
//   "PBMPART\n"
//   blocks   u64 length, bytes: key and number, parameters, metadata, report, masks of each level, columns of points
//   XXH3-128 of all that
#pragma once

#include "pbm_build/parts/part.h"
#include "system/error.h"

#include <optional>
#include <string>

namespace pbm::build {

// Which part of which build a file holds.
struct PartName {
    std::string key; // of the inputs and of all options that affect the result
    PartNumber number;
    bool operator==(const PartName &) const = default;
};

// Beside the model: "whole.pbvg.part-0-of-4".
std::string part_file_name(const std::string &output, const PartNumber &number);

// Writes the file as a whole or not at all.
//
// errors  io
Status write_part(const std::string &path, const PartName &name, const Part &part);

// errors  io         the system's own text
//         bad_input  the file is no part, damaged, or another part than `name`
Result<Part> read_part(const std::string &path, const PartName &name);

struct PartFigures {
    Grid grid;
    std::uint64_t points = 0;
};

// Nothing unless `path` holds this very part, whole.
std::optional<PartFigures> find_part(const std::string &path, const PartName &name);

} // namespace pbm::build
