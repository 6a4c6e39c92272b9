// The scans of a batch, and the files that they become.
#pragma once

#include "system/error.h"

#include <cstdint>
#include <string>
#include <vector>

namespace pbm::batch {

struct Scan {
    std::string name;        // for messages: relative to the list or folder where it lies below
    std::string input;       // path
    std::string output;      // path; no two of a batch are the same
    std::uint64_t bytes = 0; // 0: there is no such file
};

// The scans of `list_or_folder`, in its order:
//   a folder  all files in it and below that are named like scans (command_line/scan_extensions.h), packed or not, by
//             name; hidden ones are left out
//   a list    a text file with a path a line, relative to its folder; blank lines and those that begin with '#' are
//             left out; "-" is standard input, with paths relative to the working directory
// Outputs lie in `output_folder` as the scans lie in the folder or the list's folder; one from elsewhere gets its name
// only. They are named like the scan with .pbvg instead of its extension, or behind it where two would be the same
// (bust.ply and bust.obj: bust.ply.pbvg and bust.obj.pbvg).
//
// errors  usage  no scans; a path twice; no text
//         io     the list or the folder cannot be read
Result<std::vector<Scan>> read_scan_list(const std::string &list_or_folder, const std::string &output_folder);

} // namespace pbm::batch
