// Splits a file into sections, whose bytes may then change in length, and reassembles it with correct offsets, sizes
// and hashes. The contents of the sections are not checked.
#pragma once

#include "pbm_format/container/layout.h"

#include <vector>

namespace pbm::faults {

struct FileParts {
    struct Section {
        SectionEntry entry;
        Bytes bytes;
    };

    explicit FileParts(ByteView valid_file);
    Bytes assemble() const;

    Section &section(SectionType type, std::uint32_t instance = 0);

    FileHeader header;
    std::vector<Section> sections;
};

// Replaces the stored bytes of a stream of a packed chunk. `coding`: bits 24..31 of its entry.
void replace_stream(FileParts &file, int level, std::size_t chunk, std::size_t stream, ByteView stored,
                    std::uint32_t coding);
// The same for a tile of a packed raster.
void replace_tile(FileParts &file, SectionType type, std::size_t tile, ByteView stored, std::uint32_t coding);

inline constexpr std::uint32_t kZstdCoding = 0x80;

} // namespace pbm::faults
