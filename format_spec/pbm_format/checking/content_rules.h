// Rules that need the whole file: padding between sections, content_id, averages of the levels, fields.
// BVG.md 3.2.12, 7.1, 8.1, 17
#pragma once

#include "pbm_format/container/field_sections.h"

namespace pbm {

// Checks that bytes `from` to `to` of the file are zero.
Status check_padding(ByteView file, std::uint64_t from, std::uint64_t to);
Status check_content_id(const FileHeader &header, const ContentId &id);

// Fields: the header announces them (17.1.2), their id (17.6.1), and the averages of one of them (17.3.1). `section` is
// the fields section, whose other rules hold; `stored` and `computed` are columns of one level.
Status check_fields_announced(const FileHeader &header, std::span<const SectionEntry> sections);
Status check_fields_id(ByteView section, std::uint64_t offset, const Level &finest);
Status check_field_average(const Field &field, std::size_t level, ByteView stored, ByteView computed,
                           std::uint64_t offset);

// The first point of a level, and its first attribute, that is not the average of its children. `stored` and `computed`
// must differ; the error gets the offset `offset`. Of a colour it names the first byte that differs.
struct WrongAverage {
    std::size_t point;
    Error error;
};
WrongAverage find_wrong_average(std::uint64_t offset, std::size_t level, const PointAttributes &stored,
                                const PointAttributes &computed, const AttributeSet &set);

} // namespace pbm
