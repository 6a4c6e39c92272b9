// Rules that need the whole file: padding between sections, content_id, averages of the levels. BVG.md 3.2.12, 7.1, 8.1
//
#pragma once

#include "pbm_format/container/layout.h"

namespace pbm {

// Checks that bytes `from` to `to` of the file are zero.
Status check_padding(ByteView file, std::uint64_t from, std::uint64_t to);
Status check_content_id(const FileHeader &header, const ContentId &id);

// The first point of a level, and its first attribute, that is not the average of its children. `stored` and `computed`
// must differ; the error gets the offset `offset`. Of a colour it names the first byte that differs.
struct WrongAverage {
    std::size_t point;
    Error error;
};
WrongAverage find_wrong_average(std::uint64_t offset, std::size_t level, const PointAttributes &stored,
                                const PointAttributes &computed, const AttributeSet &set);

} // namespace pbm
