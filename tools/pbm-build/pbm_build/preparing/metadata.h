// The metadata section of a file: who made what from which options. Nothing normative, nothing about this machine.
#pragma once

#include "pbm_build/preparing/build_options.h"

namespace pbm::build {

struct Metadata {
    std::string text; // JSON object
    bool has_crs = false;
};

// The credits, and of the options those that were given and shape the file. `colour`: as the file has it. `crs`: the
// coordinate reference system of the scan, or empty; its name and number where the section has no room for all of it,
// and left out where it is no UTF-8 or there is no room at all.
//
// errors  usage  not UTF-8, or longer than 4 KB
Result<Metadata> make_metadata(const BuildOptions &build, ColourFormat colour, const std::string &crs);

} // namespace pbm::build
