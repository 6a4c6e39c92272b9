// Decodes the values of a field in one chunk. BVG.md 17.4 and 17.5
#pragma once

#include "pbm_format/container/field_sections.h"
#include "pbm_format/law/catalogue.h"

namespace pbm {

// `stored`: the bytes of `entry`; `masks`: those of the chunk, verified; `parents`: stored values of the chunk's nodes,
// one per mask. `to` gets field.bytes for each point. Error offsets are file offsets. After an error the contents of
// `to` are undefined.
//
// errors  bad_hash (17.5.1), bad_attribute (5.6 frames, 5.8.1 planes)
Status decode_field(const FieldEntry &entry, const Field &field, ByteView stored, ByteView masks, ByteView parents,
                    Bytes &to, Wording wording = Wording::full);

// Writes the stored values of a chunk's points from the planes of their filter, one for each of `bytes`, and the values
// of the nodes. Planes have one byte for each point with siblings, whose bytes may be any.
void unfilter_field(std::span<const ByteView> planes, std::uint8_t bytes, ByteView masks, ByteView parents,
                    std::span<std::uint8_t> to);

} // namespace pbm
