// Places the sections of a file one behind the other, and encodes the small ones. BVG.md 2 and 3
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/model.h"

#include <string_view>
#include <utility>
#include <vector>

namespace pbm {

// Checks the parameters by decoding their encoded form: what a reader would refuse is an error. Also rules 3.9.1 to
// 3.9.4, between parameters.
Status check_small_sections(const ModelParameters &parameters, std::string_view metadata);

struct EncodedSection {
    SectionEntry entry; // without the fields that FileLayout fills in
    Bytes stored;
};

// Metadata, grid, attributes, materials, lights, texture and ground plane, in the order of the file.
std::vector<EncodedSection> encode_small_sections(const ModelParameters &parameters, std::string_view metadata);

// A section of `stored` raw records of `record_bytes` bytes.
EncodedSection record_section(SectionType type, std::uint32_t instance, std::uint32_t record_bytes, Bytes stored,
                              std::uint32_t alignment = kSectionAlignment);

// Collects sections in the order of the file and places them one behind the other.
class FileLayout {
  public:
    // Adds a section; fills the fields of `entry` that follow from its bytes.
    void add(SectionEntry entry, Bytes stored);
    void add(EncodedSection section) { add(section.entry, std::move(section.stored)); }

    // Returns header, table and sections; fills the fields of `header` that follow from the sections.
    Bytes assemble(FileHeader header);

  private:
    std::vector<SectionEntry> entries_;
    std::vector<Bytes> stored_;
};

} // namespace pbm
