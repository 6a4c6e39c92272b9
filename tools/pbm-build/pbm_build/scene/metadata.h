// The metadata section of a file: who made what from which options. Nothing normative, nothing about this machine.
#pragma once

#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/grid/placement.h"
#include "pbm_build/normals/estimate_normals.h"
#include "pbm_format/container/layout.h"

#include <span>
#include <string>

namespace pbm::build {

struct Credits {
    std::string name, licence, credit; // UTF-8, may be empty
};

// An option as it was given; several of one name stand one after the other.
struct GivenOption {
    std::string name, value; // a flag: "true"
};

// How the file is written.
struct Coding {
    Storage storage = Storage::packed;
    int compression_level = 0; // of packed files
};

// The options of a build that its metadata name: of `grid` and `placement` those that were given.
struct BuildRecord {
    const Credits &credits;
    const GridRequest &grid;
    const Placement &placement;
    PointRequest points;
    ColourFormat colour; // as it was used
    Coding coding;       // as it was used
    bool flip_faces;
    std::span<const GivenOption> scene;
};

// JSON object.
//
// errors  usage  not UTF-8, or longer than 4 KB
Result<std::string> make_metadata(const BuildRecord &record);

} // namespace pbm::build
