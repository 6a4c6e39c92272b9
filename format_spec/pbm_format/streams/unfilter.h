// Filters undone, 16 or 32 points at a time, with the best instructions the processor has (Highway); the same bytes on
// every processor. BVG.md 5.8.
//
// Everything here may be untrusted but for the sizes of the spans: whatever the bytes, nothing outside of them is read
// or written, apart from kSlack.
//
//   level L - 1   node j:  normal, radius, colour ..       known
//   level L       masks    how many children node j has    decoded first
//                 points   differences to node j, one code per point; none for only children, which equal their parent
//
// A filter turns a stream into planes of bytes, each coded as a frame of its own: codes first, at last the escapes of
// what a code cannot say. Points do not depend on their siblings, so un-filtering runs over 16 points at once.
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_format/streams/sibling_layout.h"

namespace pbm {

[[gnu::pure]] std::uint8_t largest_value(ByteView values); // 0 if there is none

// Of each stored normal, one-sided and two-sided: 0 if a cone holds it, else something else. normal_cone.h
using OutsideCone = std::array<std::uint8_t, 2 * kNormalCount>;

// Memory for one thread's decoding, kept between chunks.
struct UnfilterScratch {
    SiblingLayout layout;
    OutsideCone outside;
    std::array<Bytes, 3> planes; // frames, decoded
    std::array<Bytes, 3> nodes;  // what un-filtering needs to know of the parent nodes
    Bytes packed;
};

// Escapes that codes of pairs announce: those whose low half is 15. `valid` if the high half of these is 0.
struct EscapeCount {
    std::size_t count = 0;
    bool valid = true;
};
EscapeCount count_escapes(ByteView codes);

// Each writes layout.points() points. Codes have layout.codes() bytes (all points for radii and lit fractions) and
// kSlack behind, escapes two bytes for each that the codes announce, parents layout.nodes() points.
//
struct UnfilteredNormals {
    bool valid = true;    // no escape says what cannot be
    bool outside = false; // a normal is marked in `outside`, if that is given
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
// points = prediction of the parent's value - code
void unfilter_radii(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                    ByteView codes, std::span<std::uint8_t> points);
// points = (prediction of the parent's value + code) mod 2^bits
void unfilter_shadows(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                      unsigned bits, ByteView codes, std::span<std::uint8_t> points);

} // namespace pbm
