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

// JSON object. `coding` and `colour` as they were used; of `grid` and `placement` only what was asked for;
// `scene` as it is.
//
// errors  usage  not UTF-8, or longer than 4 KB
Result<std::string> make_metadata(const Credits &credits, const GridRequest &grid, const Placement &placement,
                                  const PointRequest &points, ColourFormat colour, const Coding &coding,
                                  bool flip_faces, std::span<const GivenOption> scene);

} // namespace pbm::build
