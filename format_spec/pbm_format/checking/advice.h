// Advice: what is allowed in a .pbvg file but odd, wasteful or a slip. Warnings and infos of the catalogue.
#pragma once

#include "pbm_format/container/layout.h"

#include <vector>

namespace pbm {

struct Advice {
    Error what;              // its code is no error's; `offset` in the file
    std::int64_t chunk = -1; // number within its level, or -1
};

std::vector<Advice> advise_on_header(const FileHeader &header);
std::vector<Advice> advise_on_table(std::span<const SectionEntry> sections);
// `metadata` keeps the rules of 3.3 and starts at `offset` of the file.
std::vector<Advice> advise_on_metadata(ByteView metadata, std::uint64_t offset);

// A whole file without error: `model` as it is stored, and the directories of levels 1..depth.
struct FileContents {
    std::span<const SectionEntry> sections;
    const Model &model;
    const std::vector<LevelDirectory> &directories;
};
std::vector<Advice> advise_on_parameters(const FileContents &contents);
std::vector<Advice> advise_on_cones(const FileContents &contents, int threads);

} // namespace pbm
