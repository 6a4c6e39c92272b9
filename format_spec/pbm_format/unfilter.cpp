#include "pbm_format/unfilter.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_format/unfilter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

constexpr std::size_t kBlock = 16; // of a SiblingLayout

#if HWY_TARGET == HWY_SCALAR

constexpr std::size_t kLanes = 16;

// 16 bytes side by side, for processors without anything better.
struct Lanes {
    std::uint8_t lane[kLanes];
};

template <class Operation> HWY_INLINE Lanes for_lanes(Operation &&operation) {
    Lanes result;
    for (std::size_t i = 0; i < kLanes; ++i)
        result.lane[i] = static_cast<std::uint8_t>(operation(i));
    return result;
}

HWY_INLINE Lanes set(std::uint8_t value) {
    return for_lanes([&](std::size_t) { return value; });
}
HWY_INLINE Lanes load(const std::uint8_t *from) {
    return for_lanes([&](std::size_t i) { return from[i]; });
}
HWY_INLINE void store(Lanes a, std::uint8_t *to) { std::memcpy(to, a.lane, kLanes); }
HWY_INLINE Lanes operator+(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] + b.lane[i]; });
}
HWY_INLINE Lanes operator-(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] - b.lane[i]; });
}
HWY_INLINE Lanes operator&(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] & b.lane[i]; });
}
HWY_INLINE Lanes operator|(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] | b.lane[i]; });
}
HWY_INLINE Lanes operator^(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] ^ b.lane[i]; });
}
template <int kBits> HWY_INLINE Lanes shift_left(Lanes a) {
    return for_lanes([&](std::size_t i) { return a.lane[i] << kBits; });
}
template <int kBits> HWY_INLINE Lanes shift_right(Lanes a) {
    return for_lanes([&](std::size_t i) { return a.lane[i] >> kBits; });
}
// Lane i of a block becomes lane i + kBy.
template <int kBy> HWY_INLINE Lanes shift_lanes(Lanes a) {
    return for_lanes([&](std::size_t i) { return i < kBy ? 0 : a.lane[i - kBy]; });
}
// 255 where lanes are equal.
HWY_INLINE Lanes equal_bytes(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] == b.lane[i] ? 255 : 0; });
}
// A table of 16 bytes for each block.
HWY_INLINE Lanes load_tables(const std::uint8_t *const from[]) { return load(from[0]); }
// table[index] within each block; 0 where an index has bit 7 set
HWY_INLINE Lanes lookup(Lanes table, Lanes index) {
    return for_lanes([&](std::size_t i) { return index.lane[i] > 127 ? 0 : table.lane[index.lane[i] & 15]; });
}
// Bit i set: lanes i are equal.
HWY_INLINE unsigned equal_lanes(Lanes a, Lanes b) {
    unsigned bits = 0;
    for (unsigned i = 0; i < kLanes; ++i)
        bits |= (a.lane[i] == b.lane[i] ? 1U : 0U) << i;
    return bits;
}
HWY_INLINE Lanes largest(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return std::max(a.lane[i], b.lane[i]); });
}
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b) {
    a = for_lanes([&](std::size_t i) { return from[2 * i]; });
    b = for_lanes([&](std::size_t i) { return from[2 * i + 1]; });
}
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b, Lanes &c) {
    a = for_lanes([&](std::size_t i) { return from[3 * i]; });
    b = for_lanes([&](std::size_t i) { return from[3 * i + 1]; });
    c = for_lanes([&](std::size_t i) { return from[3 * i + 2]; });
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, std::uint8_t *to) {
    for (std::size_t i = 0; i < kLanes; ++i) {
        to[2 * i] = a.lane[i];
        to[2 * i + 1] = b.lane[i];
    }
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, Lanes c, std::uint8_t *to) {
    for (std::size_t i = 0; i < kLanes; ++i) {
        to[3 * i] = a.lane[i];
        to[3 * i + 1] = b.lane[i];
        to[3 * i + 2] = c.lane[i];
    }
}

#else

namespace hn = hwy::HWY_NAMESPACE;

// Two blocks where the machine has vectors of 32 bytes, else one.
#if HWY_MAX_BYTES >= 32
constexpr std::size_t kLanes = 32;
#else
constexpr std::size_t kLanes = 16;
#endif
using Tag = hn::FixedTag<std::uint8_t, kLanes>;
// A class of its own, so that it has operators on every target.
struct Lanes {
    hn::Vec<Tag> v;
};

HWY_INLINE Lanes set(std::uint8_t value) { return {hn::Set(Tag(), value)}; }
HWY_INLINE Lanes load(const std::uint8_t *from) { return {hn::LoadU(Tag(), from)}; }
HWY_INLINE void store(Lanes a, std::uint8_t *to) { hn::StoreU(a.v, Tag(), to); }
HWY_INLINE Lanes operator+(Lanes a, Lanes b) { return {hn::Add(a.v, b.v)}; }
HWY_INLINE Lanes operator-(Lanes a, Lanes b) { return {hn::Sub(a.v, b.v)}; }
HWY_INLINE Lanes operator&(Lanes a, Lanes b) { return {hn::And(a.v, b.v)}; }
HWY_INLINE Lanes operator|(Lanes a, Lanes b) { return {hn::Or(a.v, b.v)}; }
HWY_INLINE Lanes operator^(Lanes a, Lanes b) { return {hn::Xor(a.v, b.v)}; }
template <int kBits> HWY_INLINE Lanes shift_left(Lanes a) { return {hn::ShiftLeft<kBits>(a.v)}; }
template <int kBits> HWY_INLINE Lanes shift_right(Lanes a) { return {hn::ShiftRight<kBits>(a.v)}; }
// Lane i of each block becomes lane i + kBy.
template <int kBy> HWY_INLINE Lanes shift_lanes(Lanes a) { return {hn::ShiftLeftBytes<kBy>(Tag(), a.v)}; }
// 255 where lanes are equal.
HWY_INLINE Lanes equal_bytes(Lanes a, Lanes b) { return {hn::VecFromMask(Tag(), hn::Eq(a.v, b.v))}; }
// A table of 16 bytes for each block.
HWY_INLINE Lanes load_tables(const std::uint8_t *const from[]) {
#if HWY_MAX_BYTES >= 32
    const hn::Half<Tag> half;
    return {hn::Combine(Tag(), hn::LoadU(half, from[1]), hn::LoadU(half, from[0]))};
#else
    return load(from[0]);
#endif
}
// table[index] within each block; 0 where an index has bit 7 set
HWY_INLINE Lanes lookup(Lanes table, Lanes index) { return {hn::TableLookupBytesOr0(table.v, index.v)}; }
// Bit i set: lanes i are equal.
HWY_INLINE unsigned equal_lanes(Lanes a, Lanes b) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(Tag(), hn::Eq(a.v, b.v), bits);
    std::uint32_t all;
    std::memcpy(&all, bits, sizeof all);
    return all;
}
HWY_INLINE Lanes largest(Lanes a, Lanes b) { return {hn::Max(a.v, b.v)}; }
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b) {
    hn::LoadInterleaved2(Tag(), from, a.v, b.v);
}
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b, Lanes &c) {
    hn::LoadInterleaved3(Tag(), from, a.v, b.v, c.v);
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, std::uint8_t *to) { hn::StoreInterleaved2(a.v, b.v, Tag(), to); }
HWY_INLINE void store_interleaved(Lanes a, Lanes b, Lanes c, std::uint8_t *to) {
    hn::StoreInterleaved3(a.v, b.v, c.v, Tag(), to);
}

#endif

// Walks over the points of a chunk, kLanes at a time.
class Strides {
  public:
    explicit Strides(const SiblingLayout &layout)
        : block_(layout.blocks()), parents_(layout.parents()), codes_(layout.codes_of_points()),
          points_(layout.points()) {}

    bool done() const { return at_ >= points_; }
    void next() {
        at_ += kLanes;
        block_ += kLanes / kBlock;
    }
    std::size_t at() const { return at_; }
    bool whole() const { return points_ - at_ >= kLanes; }
    std::size_t count() const { return std::min(kLanes, points_ - at_); }

    // Values of the points' parent nodes.
    Lanes of_parents(const Bytes &nodes) const {
        const std::uint8_t *tables[kLanes / kBlock];
        for (std::size_t b = 0; b < kLanes / kBlock; ++b)
            tables[b] = nodes.data() + block_[b].first_node;
        return lookup(load_tables(tables), load(parents_ + at_));
    }
    // Codes of the points; 0 for only children.
    Lanes of_codes(ByteView codes) const {
        const std::uint8_t *tables[kLanes / kBlock];
        for (std::size_t b = 0; b < kLanes / kBlock; ++b)
            tables[b] = codes.data() + block_[b].first_code;
        return lookup(load_tables(tables), load(codes_ + at_));
    }
    std::size_t node_of(std::size_t point) const { return block_[point / kBlock].first_node + parents_[at_ + point]; }

  private:
    const SiblingLayout::Block *block_;
    const std::uint8_t *parents_, *codes_;
    std::size_t points_, at_ = 0;
};

HWY_INLINE Lanes unzigzag(Lanes code) { return shift_right<1>(code) ^ (set(0) - (code & set(1))); }
HWY_INLINE std::uint8_t unzigzag(unsigned code) { return static_cast<std::uint8_t>(code >> 1 ^ (0U - (code & 1U))); }

// Writes a whole stride, or the part of it that there is.
HWY_INLINE void store(Lanes values, const Strides &stride, std::uint8_t *points) {
    if (stride.whole())
        return store(values, points + stride.at());
    std::uint8_t last[kLanes];
    store(values, last);
    std::memcpy(points + stride.at(), last, stride.count());
}

unsigned count_lanes(unsigned bits) { return static_cast<unsigned>(std::popcount(bits)); }

MaskSummary summarise_masks(ByteView masks) {
    MaskSummary summary;
    std::size_t at = 0;
    for (; at + kLanes <= masks.size(); at += kLanes) {
        const Lanes some = load(masks.data() + at);
        std::array<std::uint64_t, kLanes / 8> eights{};
        std::memcpy(eights.data(), masks.data() + at, kLanes);
        for (const std::uint64_t eight : eights)
            summary.children += static_cast<unsigned>(std::popcount(eight));
        summary.only_children += count_lanes(equal_lanes(some & (some - set(1)), set(0)));
        summary.zero |= equal_lanes(some, set(0)) != 0;
    }
    for (; at < masks.size(); ++at) {
        summary.children += static_cast<unsigned>(std::popcount(masks[at]));
        summary.only_children += (masks[at] & (masks[at] - 1U)) == 0 ? 1U : 0U;
        summary.zero |= masks[at] == 0;
    }
    return summary;
}

std::uint8_t largest_value(ByteView values) {
    Lanes most = set(0);
    std::size_t at = 0;
    for (; at + kLanes <= values.size(); at += kLanes)
        most = largest(most, load(values.data() + at));
    std::uint8_t last[kLanes];
    store(most, last);
    std::uint8_t value = *std::max_element(last, last + kLanes);
    for (; at < values.size(); ++at)
        value = std::max(value, values[at]);
    return value;
}

// Bits 0..7 of each point's node; eight at a time, of which the next node overwrites those that are not its own.
void number_parents(ByteView masks, std::uint8_t *numbers) {
    constexpr std::uint64_t kOnes = 0x0101010101010101;
    for (std::size_t node = 0; node < masks.size(); ++node) {
        const std::uint64_t eight = (node & 255) * kOnes;
        std::memcpy(numbers, &eight, 8);
        numbers += std::popcount(masks[node]);
    }
}

// Points have siblings if one of their neighbours has the same parent. `numbers` has one byte before and kSlack
// behind, the others have room for whole strides.
void lay_out_siblings(const std::uint8_t *numbers, std::size_t points, SiblingLayout::Block *blocks,
                      std::uint8_t *parents, std::uint8_t *codes_of_points) {
    std::uint32_t first_node = 0, first_code = 0;
    for (std::size_t at = 0; at < points; at += kLanes) {
        const Lanes number = load(numbers + at);
        const Lanes siblings =
            equal_bytes(number, load(numbers + at - 1)) | equal_bytes(number, load(numbers + at + 1));
        const Lanes one = siblings & set(1);
        Lanes codes = one; // up to each point of a block, it included
        codes = codes + shift_lanes<1>(codes);
        codes = codes + shift_lanes<2>(codes);
        codes = codes + shift_lanes<4>(codes);
        codes = codes + shift_lanes<8>(codes);
        std::uint8_t counts[kLanes];
        store(codes, counts);
        store((number - lookup(number, set(0))) & set(15), parents + at);
        store(((codes - one) & set(15)) | (set(128) - (siblings & set(128))), codes_of_points + at);
        for (std::size_t block = 0; block < kLanes; block += kBlock) {
            *blocks++ = {first_node, first_code};
            if (at + block + kBlock >= points)
                continue; // a last block that is there only to complete the stride looks up what this one does
            first_node += static_cast<std::uint8_t>(numbers[at + block + kBlock] - numbers[at + block]);
            first_code += counts[block + kBlock - 1];
        }
    }
}

EscapeCount count_escapes(ByteView codes) {
    std::size_t low = 0, whole = 0, at = 0;
    for (; at + kLanes <= codes.size(); at += kLanes) {
        const Lanes some = load(codes.data() + at);
        low += count_lanes(equal_lanes(some & set(15), set(15)));
        whole += count_lanes(equal_lanes(some, set(15)));
    }
    for (; at < codes.size(); ++at) {
        low += (codes[at] & 15) == 15 ? 1U : 0U;
        whole += codes[at] == 15 ? 1U : 0U;
    }
    return {low, low == whole};
}

// Cells of the normals of the positive octant.
struct PositiveCells {
    std::array<std::uint8_t, 1024> u{}, v{};

    PositiveCells() {
        for (std::size_t i = 0; i < u.size(); ++i) {
            u[i] = static_cast<std::uint8_t>(normal_cells()[i] & 127);
            v[i] = static_cast<std::uint8_t>(normal_cells()[i] >> 7);
        }
    }
};

// Of each parent node its cell when mirrored into the positive octant, and the bits that mirror it back: octant and
// two-sided.
void split_parents(std::span<const std::uint16_t> parents, std::uint8_t *us, std::uint8_t *vs, std::uint8_t *mirrors) {
    static const PositiveCells cells;
    const std::uint8_t *u = cells.u.data(), *v = cells.v.data();
    for (std::size_t node = 0; node < parents.size(); ++node) {
        const unsigned normal = parents[node];
        us[node] = u[normal & 1023];
        vs[node] = v[normal & 1023];
        mirrors[node] = static_cast<std::uint8_t>(normal >> 10 & 15);
    }
}

template <bool kCompares>
UnfilteredNormals unfilter_and_compare(UnfilterScratch &scratch, std::span<const std::uint16_t> parents, ByteView codes,
                                       ByteView escapes, std::span<std::uint16_t> points, const std::uint8_t *outside) {
    const std::uint16_t *normals = normals_of_cells().data();
    auto &[us, vs, mirrors] = scratch.nodes;
    split_parents(parents, us.data(), vs.data(), mirrors.data());
    const std::uint8_t *escape = escapes.data();
    bool valid = true;
    std::uint8_t marks = 0;
    std::uint16_t cell[kLanes], mirror[kLanes], last[kLanes];
    for (Strides stride(scratch.layout); !stride.done(); stride.next()) {
        const Lanes code = stride.of_codes(codes);
        const Lanes low = code & set(15);
        const Lanes u = (stride.of_parents(us) + unzigzag(low)) & set(127);
        const Lanes v = (stride.of_parents(vs) + unzigzag(shift_right<4>(code))) & set(63);
        // u + 128 v from bytes: the low byte takes v's lowest bit, the high byte the others.
        store_interleaved(u | shift_left<7>(v), shift_right<1>(v), reinterpret_cast<std::uint8_t *>(cell));
        store_interleaved(set(0), shift_left<2>(stride.of_parents(mirrors)), reinterpret_cast<std::uint8_t *>(mirror));

        for (unsigned left = equal_lanes(low, set(15)); left != 0; left &= left - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(left));
            if (i >= stride.count())
                break;
            const std::size_t node = stride.node_of(i);
            valid &= escape[1] < 64;
            const unsigned to_u = (us[node] + unzigzag(escape[0] & 127U)) & 127U;
            const unsigned to_v = (vs[node] + unzigzag(static_cast<unsigned>(escape[1]))) & 63U;
            cell[i] = static_cast<std::uint16_t>(to_u | to_v << 7);
            mirror[i] = static_cast<std::uint16_t>(mirror[i] ^ (escape[0] >> 7) * kTwoSidedBit);
            escape += 2;
        }
        const bool whole = stride.whole();
        std::uint16_t *to = whole ? points.data() + stride.at() : last;
        if (!whole) // what is past the end is the first again
            for (std::size_t i = stride.count(); i < kLanes; ++i) {
                cell[i] = cell[0];
                mirror[i] = mirror[0];
            }
        for (std::size_t eight = 0; eight < kLanes; eight += 8) { // so few that compilers unroll the inner loop
            std::uint8_t marks_of_eight = 0;
            for (std::size_t i = eight; i < eight + 8; i += 2) { // a store for two
                std::uint32_t mirrors_of_both;
                std::memcpy(&mirrors_of_both, mirror + i, sizeof mirrors_of_both);
                const std::uint32_t both =
                    (normals[cell[i]] | static_cast<std::uint32_t>(normals[cell[i + 1]]) << 16) ^ mirrors_of_both;
                std::memcpy(to + i, &both, sizeof both);
                if constexpr (kCompares) // indices are below 2 x kNormalCount, whatever the bytes
                    marks_of_eight |= static_cast<std::uint8_t>(outside[both & 0xFFFF] | outside[both >> 16]);
            }
            marks |= marks_of_eight;
        }
        if (!whole)
            std::memcpy(points.data() + stride.at(), last, sizeof *last * stride.count());
    }
    return {.valid = valid, .outside = marks != 0};
}

UnfilteredNormals unfilter_normals(UnfilterScratch &scratch, std::span<const std::uint16_t> parents, ByteView codes,
                                   ByteView escapes, std::span<std::uint16_t> points, const OutsideCone *outside) {
    return outside == nullptr ? unfilter_and_compare<false>(scratch, parents, codes, escapes, points, nullptr)
                              : unfilter_and_compare<true>(scratch, parents, codes, escapes, points, outside->data());
}

void unfilter_colours_888(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points) {
    auto &[reds, greens, blues] = scratch.nodes;
    std::size_t node = 0;
    for (; 3 * (node + kLanes) <= parents.size(); node += kLanes) {
        Lanes r, g, b;
        load_interleaved(parents.data() + 3 * node, r, g, b);
        store(r, reds.data() + node);
        store(g, greens.data() + node);
        store(b, blues.data() + node);
    }
    for (; 3 * node < parents.size(); ++node) {
        reds[node] = parents[3 * node];
        greens[node] = parents[3 * node + 1];
        blues[node] = parents[3 * node + 2];
    }
    const std::uint8_t *escape = escapes.data();
    std::uint8_t last[3 * kLanes];
    for (Strides stride(scratch.layout); !stride.done(); stride.next()) {
        const Lanes change = unzigzag(stride.of_codes(green)), pair = stride.of_codes(red_blue);
        const Lanes low = pair & set(15);
        const Lanes r = stride.of_parents(reds) + change + unzigzag(low);
        const Lanes g = stride.of_parents(greens) + change;
        const Lanes b = stride.of_parents(blues) + change + unzigzag(shift_right<4>(pair));
        std::uint8_t *to = points.data() + 3 * stride.at();
        const bool whole = stride.whole();
        store_interleaved(r, g, b, whole ? to : last);
        if (!whole)
            std::memcpy(to, last, 3 * stride.count());
        for (unsigned left = equal_lanes(low, set(15)); left != 0; left &= left - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(left));
            if (i >= stride.count())
                break;
            const std::size_t parent = stride.node_of(i);
            const auto both = static_cast<std::uint8_t>(to[3 * i + 1] - greens[parent]);
            to[3 * i] = static_cast<std::uint8_t>(reds[parent] + both + unzigzag(static_cast<unsigned>(escape[0])));
            to[3 * i + 2] =
                static_cast<std::uint8_t>(blues[parent] + both + unzigzag(static_cast<unsigned>(escape[1])));
            escape += 2;
        }
    }
}

void unfilter_colours_565(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points) {
    auto &[reds, greens, blues] = scratch.nodes;
    std::size_t node = 0;
    for (; 2 * (node + kLanes) <= parents.size(); node += kLanes) {
        Lanes low, high;
        load_interleaved(parents.data() + 2 * node, low, high);
        store(shift_right<3>(high), reds.data() + node);
        store((shift_left<3>(high) & set(56)) | shift_right<5>(low), greens.data() + node);
        store(low & set(31), blues.data() + node);
    }
    for (; 2 * node < parents.size(); ++node) {
        const unsigned colour = parents[2 * node] | static_cast<unsigned>(parents[2 * node + 1]) << 8;
        reds[node] = static_cast<std::uint8_t>(colour >> 11);
        greens[node] = static_cast<std::uint8_t>(colour >> 5 & 63);
        blues[node] = static_cast<std::uint8_t>(colour & 31);
    }
    const std::uint8_t *escape = escapes.data();
    std::uint8_t last[2 * kLanes];
    for (Strides stride(scratch.layout); !stride.done(); stride.next()) {
        const Lanes code = stride.of_codes(green), pair = stride.of_codes(red_blue);
        const Lanes low = pair & set(15);
        const Lanes sign = set(0) - (code & set(1));
        const Lanes half = (shift_right<2>(code + set(1)) ^ sign) - sign;
        Lanes r = stride.of_parents(reds) + half + unzigzag(low);
        Lanes b = stride.of_parents(blues) + half + unzigzag(shift_right<4>(pair));
        const Lanes g = (stride.of_parents(greens) + unzigzag(code)) & set(63);
        if (unsigned left = equal_lanes(low, set(15)); left != 0) {
            std::uint8_t red[kLanes], blue[kLanes], halves[kLanes];
            store(r, red);
            store(b, blue);
            store(half, halves);
            for (; left != 0; left &= left - 1) {
                const auto i = static_cast<std::size_t>(std::countr_zero(left));
                if (i >= stride.count())
                    break;
                const std::size_t parent = stride.node_of(i);
                red[i] =
                    static_cast<std::uint8_t>(reds[parent] + halves[i] + unzigzag(static_cast<unsigned>(escape[0])));
                blue[i] =
                    static_cast<std::uint8_t>(blues[parent] + halves[i] + unzigzag(static_cast<unsigned>(escape[1])));
                escape += 2;
            }
            r = load(red);
            b = load(blue);
        }
        // red in bits 3..7 of the high byte; green's high half below it, its low half above blue in the low byte
        const Lanes high = shift_left<3>(r) | shift_right<3>(g);
        const Lanes lower = shift_left<5>(g) | (b & set(31));
        std::uint8_t *to = points.data() + 2 * stride.at();
        const bool whole = stride.whole();
        store_interleaved(lower, high, whole ? to : last);
        if (!whole)
            std::memcpy(to, last, 2 * stride.count());
    }
}

void unfilter_materials(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    std::copy(parents.begin(), parents.end(), nodes.begin());
    for (Strides stride(scratch.layout); !stride.done(); stride.next())
        store(stride.of_parents(nodes) ^ stride.of_codes(codes), stride, points.data());
}

void unfilter_textures(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    std::copy(parents.begin(), parents.end(), nodes.begin());
    for (Strides stride(scratch.layout); !stride.done(); stride.next())
        store(stride.of_parents(nodes) + unzigzag(stride.of_codes(codes)), stride, points.data());
}

void unfilter_radii(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                    ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    for (std::size_t node = 0; node < parents.size(); ++node)
        nodes[node] = predictions[parents[node]];
    for (Strides stride(scratch.layout); !stride.done(); stride.next())
        store(stride.of_parents(nodes) - load(codes.data() + stride.at()), stride, points.data());
}

void unfilter_shadows(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                      unsigned bits, ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    for (std::size_t node = 0; node < parents.size(); ++node)
        nodes[node] = predictions[parents[node]];
    const Lanes wheel = set(static_cast<std::uint8_t>((1U << bits) - 1));
    for (Strides stride(scratch.layout); !stride.done(); stride.next()) {
        const Lanes code = load(codes.data() + stride.at());
        store((stride.of_parents(nodes) + code) & wheel, stride, points.data());
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(summarise_masks);
HWY_EXPORT(largest_value);
HWY_EXPORT(number_parents);
HWY_EXPORT(lay_out_siblings);
HWY_EXPORT(count_escapes);
HWY_EXPORT(unfilter_normals);
HWY_EXPORT(unfilter_colours_888);
HWY_EXPORT(unfilter_colours_565);
HWY_EXPORT(unfilter_materials);
HWY_EXPORT(unfilter_textures);
HWY_EXPORT(unfilter_radii);
HWY_EXPORT(unfilter_shadows);

MaskSummary summarise_masks(ByteView masks) { return HWY_DYNAMIC_DISPATCH(summarise_masks)(masks); }

std::uint8_t largest_value(ByteView values) { return HWY_DYNAMIC_DISPATCH(largest_value)(values); }

void SiblingLayout::build(ByteView masks, const MaskSummary &summary) {
    assert(!summary.zero);
    nodes_ = masks.size();
    points_ = summary.children;
    codes_ = points_ - summary.only_children;
    const std::size_t room = points_ + kSlack;
    numbers_.resize(std::max(numbers_.size(), 1 + room));
    parents_.resize(std::max(parents_.size(), room));
    codes_of_points_.resize(std::max(codes_of_points_.size(), room));
    blocks_.resize(std::max(blocks_.size(), room / 16));
    std::uint8_t *numbers = numbers_.data() + 1;
    HWY_DYNAMIC_DISPATCH(number_parents)(masks, numbers);
    // Neighbours of the first and of the last point that are no siblings.
    numbers[-1] = static_cast<std::uint8_t>(numbers[0] - 1);
    numbers[points_] = static_cast<std::uint8_t>(numbers[points_ - 1] + 1);
    HWY_DYNAMIC_DISPATCH(lay_out_siblings)
    (numbers, points_, blocks_.data(), parents_.data(), codes_of_points_.data());
}

EscapeCount count_escapes(ByteView codes) { return HWY_DYNAMIC_DISPATCH(count_escapes)(codes); }

namespace {

void make_room(UnfilterScratch &scratch) {
    for (Bytes &nodes : scratch.nodes)
        nodes.resize(std::max(nodes.size(), scratch.layout.nodes() + kSlack));
}

} // namespace

UnfilteredNormals unfilter_normals(UnfilterScratch &scratch, std::span<const std::uint16_t> parents, ByteView codes,
                                   ByteView escapes, std::span<std::uint16_t> points, const OutsideCone *outside) {
    make_room(scratch);
    return HWY_DYNAMIC_DISPATCH(unfilter_normals)(scratch, parents, codes, escapes, points, outside);
}

void unfilter_colours_888(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points) {
    make_room(scratch);
    HWY_DYNAMIC_DISPATCH(unfilter_colours_888)(scratch, parents, green, red_blue, escapes, points);
}

void unfilter_colours_565(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points) {
    make_room(scratch);
    HWY_DYNAMIC_DISPATCH(unfilter_colours_565)(scratch, parents, green, red_blue, escapes, points);
}

void unfilter_materials(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points) {
    make_room(scratch);
    HWY_DYNAMIC_DISPATCH(unfilter_materials)(scratch, parents, codes, points);
}

void unfilter_textures(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points) {
    make_room(scratch);
    HWY_DYNAMIC_DISPATCH(unfilter_textures)(scratch, parents, codes, points);
}

void unfilter_radii(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                    ByteView codes, std::span<std::uint8_t> points) {
    make_room(scratch);
    HWY_DYNAMIC_DISPATCH(unfilter_radii)(scratch, parents, predictions, codes, points);
}

void unfilter_shadows(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                      unsigned bits, ByteView codes, std::span<std::uint8_t> points) {
    make_room(scratch);
    HWY_DYNAMIC_DISPATCH(unfilter_shadows)(scratch, parents, predictions, bits, codes, points);
}

} // namespace pbm
#endif // HWY_ONCE
