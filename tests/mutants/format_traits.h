// What the test knows of each format.
#pragma once

#include "mutants/count.h"
#include "mutants/mutate.h"
#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>
#include <string_view>

namespace pbm::mutants {

struct FormatTraits {
    const char *name;
    std::string_view scan_format; // pbm_scan/formats.h
    std::optional<Announced> (*count)(std::string_view bytes);
    // Of a file that was cut and that the reader loaded: what is wrong with that; empty: nothing.
    std::string (*judge_cut)(const Mutant &mutant, const build::Surface &surface);
};

const FormatTraits &traits(Format format);

} // namespace pbm::mutants
