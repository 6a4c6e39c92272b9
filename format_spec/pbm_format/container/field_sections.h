// Byte layout of the fields: their section, and the directories of their values. BVG.md 17.2 and 17.4
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/hashes/hash.h"

namespace pbm {

// The fields section.
struct FieldTable {
    Hash128 id{};                     // fields_id, see there
    std::vector<Field> fields;        // 1..kMaxFields
    std::vector<std::uint16_t> roots; // stored values of the model as one point, a field each
};

inline constexpr std::size_t kFieldsIdBytes = 16, kFieldRecordBytes = 96;

// Offsets of errors count from the section's start.
//
// errors  bad_section          17.2.1 to 17.2.3, 17.2.5, 17.2.6
//         unsupported_feature  17.2.4
Result<FieldTable> decode_fields(ByteView bytes);
Bytes encode_fields(const FieldTable &table);

// Covers the records and the stored values of the finest points. BVG.md 17.6
Hash128 fields_id(const FieldTable &table, const Level &finest);

// The table of a model with fields.
FieldTable field_table(const Model &model);

// One field of one chunk.
struct FieldEntry {
    std::uint64_t hash = 0; // XXH3-64 of the stored bytes
    StreamEntry stream;
    std::uint64_t offset = 0; // of the stored bytes in the file; computed by decode_field_directory

    FileRange range() const { return {offset, stream.stored_bytes}; }
};

// The entries of a level: [chunks][fields].
struct FieldDirectory {
    std::vector<FieldEntry> entries;
    std::size_t fields = 0;

    const FieldEntry &at(std::size_t chunk, std::size_t field) const { return entries[chunk * fields + field]; }
};

inline constexpr std::size_t kFieldEntryBytes = 12;

// The filter that a field's stream may have besides none.
inline Filter filter_of(const Field &field) { return field.bytes == 1 ? Filter::texture : Filter::field16; }

// `level`: the directory of the chunks; `values`: the section of the values.
//
// errors  bad_directory        17.4.1, 17.4.3, 17.4.5
//         unsupported_feature  17.4.2
//         too_large            17.4.4
Result<FieldDirectory> decode_field_directory(ByteView bytes, const LevelDirectory &level,
                                              std::span<const Field> fields, const SectionEntry &values);
Bytes encode_field_directory(const FieldDirectory &directory);

} // namespace pbm
