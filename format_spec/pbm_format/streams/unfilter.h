// Inverts the filters of streams, 16 or 32 points at a time. SIMD (Highway), equal on every processor. BVG.md 5.8
//
// Only the sizes of spans are trusted, their bytes are not: accesses stay inside the spans, apart from kSlack.
//
//   level L - 1   node j:  normal, radius, colour ..       known
//   level L       masks    number of children of node j    decoded first
//                 points   differences to node j, one code per point; none for only children, which equal their parent
//
// A filter turns a stream into planes of bytes, each stored as a frame: first the codes, last the escapes, which hold
// differences that do not fit a code. Points do not depend on their siblings, so 16 points are unfiltered at once.
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_format/streams/sibling_layout.h"

namespace pbm {

[[gnu::pure]] std::uint8_t largest_value(ByteView values); // 0 if `values` is empty

// Per stored normal, one-sided and two-sided: 0 if it lies in a cone, else nonzero. See normal_cone.h
using OutsideCone = std::array<std::uint8_t, 2 * kNormalCount>;

// Memory of one thread, reused for the next chunk.
struct UnfilterScratch {
    SiblingLayout layout;
    OutsideCone outside;
    std::array<Bytes, 3> planes; // decoded frames
    std::array<Bytes, 3> nodes;  // values of the parent nodes, prepared for unfiltering
    Bytes packed;
};

// Number of escapes in codes of pairs: codes with low half 15. `valid` if the high halves of all these are 0.
struct EscapeCount {
    std::size_t count = 0;
    bool valid = true;
};
EscapeCount count_escapes(ByteView codes);

// Each function writes layout.points() points. Codes (`codes`, `green`, `red_blue`) have layout.codes() bytes, for
// radii and lit fractions layout.points(), and kSlack behind; `escapes` two per escape; `parents` layout.nodes()
// points.
struct UnfilteredNormals {
    bool valid = true;    // false: an escape is impossible
    bool outside = false; // a normal is marked in `outside`, if given
};
UnfilteredNormals unfilter_normals(UnfilterScratch &scratch, std::span<const std::uint16_t> parents, ByteView codes,
                                   ByteView escapes, std::span<std::uint16_t> points,
                                   const OutsideCone *outside = nullptr);
void unfilter_colours_888(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points);
void unfilter_colours_565(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points);
void unfilter_materials(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points);
void unfilter_textures(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points);
// point = prediction of the parent's value - code
void unfilter_radii(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                    ByteView codes, std::span<std::uint8_t> points);
// point = (prediction of the parent's value + code) mod 2^bits
void unfilter_shadows(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                      unsigned bits, ByteView codes, std::span<std::uint8_t> points);

} // namespace pbm
