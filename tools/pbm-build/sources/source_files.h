// The files that decide a model: those that are given, and those that they name, there or not.
#pragma once

#include "pbm_scan/surface/surface.h"
#include "system/error.h"

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace pbm::build {

// A file that is given.
struct GivenFile {
    std::string file;
    bool is_input = false;          // a scan, not the file of an option
    std::vector<NamedFile> named{}; // what reading it looks for, in this order
};

struct SourceFiles {
    std::vector<GivenFile> given;
    std::vector<std::string> there;   // every file that is read, once; those that are given first
    std::vector<std::string> missing; // every place that is looked at and has no file, once

    // file_state of `there` before they were read.
    std::vector<std::string> states;
};

// `inputs`: those of `given` that are scans. `recipe`: a file whose content has been taken already; empty: none.
SourceFiles find_sources(std::span<const std::string> given, std::span<const std::string> inputs,
                         const std::string &recipe);

// Call after the sources were read: what was read is what is there.
//
// errors  io  a file has changed since find_sources, or one that was missing has appeared; the message names it
Status verify_unchanged(const SourceFiles &sources);

} // namespace pbm::build
