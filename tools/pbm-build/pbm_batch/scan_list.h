// The scans of a batch, and the files that they become.
#pragma once

#include "system/error.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::batch {

struct Scan {
    std::string name;        // for messages: relative to the root
    std::string input;       // path
    std::string output;      // path; no two of a batch are the same
    std::uint64_t bytes = 0; // 0: there is no such file
};

// What lies in a folder of scans and is not built.
struct LeftOut {
    std::string path;
    std::string kind;           // for messages: "FBX", "pipe", "linked folder"
    bool is_unreadable = false; // a folder whose scans nobody knows
};

// "FBX (2), pipe (1)".
std::string kinds_of(std::span<const LeftOut> left_out);

struct ScanRequest {
    std::string list_or_folder, output_folder;
    std::string root;            // of a list: models lie in the output folder as scans lie here; empty: its folder
    bool keep_extension = false; // "lion.ply.pbvg" instead of "lion.pbvg"
    bool keep_going = false;     // leave out a folder that cannot be read
};

struct ScanList {
    std::vector<Scan> scans;
    std::vector<LeftOut> left_out; // of a folder
};

// The folder as which the output folder is arranged; empty: the working directory.
std::string root_of(const ScanRequest &request);

// The scans of `list_or_folder`, in its order:
//   a folder  all files in it and below that are named like scans (command_line/scan_extensions.h), packed or not, by
//             name, and links to files that are missing; hidden ones are not looked at, nor tables named .txt or .csv
//   a list    a text file with a path a line, relative to its folder; blank lines and those that begin with '#' are
//             left out; "-" is standard input, with paths relative to the working directory
// A scan from elsewhere than below the root becomes a model at the top of the output folder. The name of a model
// depends on its scan alone.
//
// errors  io     the list or a folder cannot be read; the message begins with a folder that is not the root itself
//         usage  no scan; a scan that is named twice; two scans that would become one file
Result<ScanList> read_scan_list(const ScanRequest &request);

// Models in the output folder and below that none of `scans` becomes, by name.
std::vector<std::string> other_models(const std::string &output_folder, std::span<const Scan> scans);

} // namespace pbm::batch
