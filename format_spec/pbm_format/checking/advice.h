// Advice: warnings and infos of the catalogue on what is allowed in a .pbvg file but odd or wasteful.
#pragma once

#include "pbm_format/container/layout.h"

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

// A file without errors: `model` as stored, and the directories of levels 1..depth.
struct FileContents {
    std::span<const SectionEntry> sections;
    const Model &model;
    const std::vector<LevelDirectory> &directories;
};
std::vector<Advice> advise_on_parameters(const FileContents &contents);
std::vector<Advice> advise_on_cones(const FileContents &contents, int threads);

} // namespace pbm
