// Small valid files, and their division into regions.
#pragma once

#include "pbm_format/rasters/image_section.h"
#include "pbm_format/reading/reader.h"

#include <cstdint>
#include <string>
#include <vector>

namespace pbm::faults {

struct Golden {
    std::string name;
    Bytes bytes;
};

// Valid files of format_spec/vectors up to `max_bytes`, smallest first. Small ones already have every stream and every
// raster, packed and mapped.
std::vector<Golden> goldens(std::size_t max_bytes);
// The same, and the files of format_spec/golden: scans built with every feature.
std::vector<Golden> goldens_and_scans(std::size_t max_bytes);
// Invalid files, one for each rule.
std::vector<Golden> broken_vectors();

// Parts whose damage is reported separately.
enum class Part : std::uint8_t { header, table, padding, section, chunk, bricks, raster_head, tile };

struct Region {
    Part part{};
    std::uint64_t begin = 0, end = 0; // bytes of the file
    const SectionEntry *section{};    // of the golden's reader; null for header, table and padding between sections
    int level = 0;                    // chunk, bricks
    std::size_t index = 0;            // chunk, bricks: the chunk within its level; tile
    std::uint64_t section_begin = 0, section_end = 0; // of the whole section, or begin and end
};

// Regions in file order, without gaps. `reader` belongs to a valid file and has read its directories.
std::vector<Region> regions_of(Reader &reader, ByteView file);
std::string describe(const Region &region);

} // namespace pbm::faults
