// Rules that need the whole file: padding between sections, content_id, averages of the levels, fields.
// BVG.md 3.2.12, 7.1, 8.1, 17
#pragma once

#include "pbm_format/container/field_sections.h"

#include <optional>

namespace pbm {

// Checks that bytes `from` to `to` of the file are zero.
Status check_padding(ByteView file, std::uint64_t from, std::uint64_t to);
Status check_content_id(const FileHeader &header, const ContentId &id);

// Fields: the header announces them (17.1.2), and their id (17.6.1). `offset` is that of the fields section.
Status check_fields_announced(const FileHeader &header, std::span<const SectionEntry> sections);
Status check_fields_id(const FieldTable &table, const Hash128 &id, std::uint64_t offset);

// A point of a level, and its first attribute, that is not the average of its children.
struct WrongAverage {
    std::uint64_t point;
    Error error;
};
// Compares points of `level`, from number `first` on, as they are stored and as they should be: 7.1. The error gets the
// offset `offset`. Of a colour it names the first byte that differs.
std::optional<WrongAverage> find_wrong_average(std::uint64_t offset, int level, std::uint64_t first,
                                               const PointView &stored, const PointView &computed,
                                               const AttributeSet &set);
// The same for the stored values of a field: 17.3.1.
std::optional<WrongAverage> find_wrong_average(std::uint64_t offset, int level, std::uint64_t first, const Field &field,
                                               ByteView stored, ByteView computed);

} // namespace pbm
