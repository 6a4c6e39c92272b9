// Advice: warnings and infos of the catalogue on what is allowed in a .pbvg file but odd or wasteful.
#pragma once

#include "pbm_format/container/layout.h"

#include <array>
#include <vector>

namespace pbm {

struct Advice {
    Error what;              // a fault of the catalogue that is no error; `offset` in the file
    std::int64_t chunk = -1; // number within its level, or -1
};

std::vector<Advice> advise_on_header(const FileHeader &header);
std::vector<Advice> advise_on_table(std::span<const SectionEntry> sections);
// `metadata` obeys the rules of 3.3 and starts at `offset` of the file.
std::vector<Advice> advise_on_metadata(ByteView metadata, std::uint64_t offset);

// What the points use of the parameters.
struct UsedParameters {
    std::array<bool, 256> materials{};
    std::array<bool, kMaxLights> lit{}; // some point is lit, not in shadow
    std::uint8_t octants = 0;           // child mask of the root

    void add(const UsedParameters &other);
};
UsedParameters used_parameters(const PointAttributes &points);

// A chunk whose normal cone is wider than needed.
struct LooseCone {
    int level;
    std::size_t chunk;
    std::int16_t stored, narrowest; // cosines
};

// Of a file without errors. `lit_ground`: lights that reach some texel of the ground plane.
std::vector<Advice> advise_on_parameters(std::span<const SectionEntry> sections, const ModelParameters &parameters,
                                         const UsedParameters &used, const std::array<bool, kMaxLights> &lit_ground);
Advice advise_on_cone(std::span<const SectionEntry> sections, const AttributeSet &set, const LooseCone &cone);

} // namespace pbm
