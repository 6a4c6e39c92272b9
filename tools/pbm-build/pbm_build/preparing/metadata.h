// The metadata section of a file: who made what from which options. Nothing normative, nothing about this machine.
#pragma once

#include "pbm_build/preparing/build_options.h"

#include <span>
#include <string>

namespace pbm::build {

struct Metadata {
    std::string text; // JSON object
    bool has_crs = false;
    std::size_t views = 0, part_names = 0; // so many of the scan's
};

// What the metadata says of the scan itself.
struct ScanFacts {
    ColourFormat colour = ColourFormat::none; // of the file
    bool is_uncoloured_cloud = false;         // points without faces, colours, normals and materials
    std::string crs{};                        // coordinate reference system, or empty
    std::span<const SceneView> views{};
    std::span<const std::string> part_names{};
};

// The credits, and of the options those that were given and shape the file. An uncoloured cloud is named as one, unless
// an option of the scene gives it a look. Of the coordinate reference system, the metadata has name and number where
// the section has no room for all of it; it is left out where it is no UTF-8 or there is no room at all. Views and
// names of parts follow, the first ones, as far as there is room.
//
// errors  usage  not UTF-8, or longer than 4 KB
Result<Metadata> make_metadata(const BuildOptions &build, const ScanFacts &scan);

} // namespace pbm::build
