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

// Points are taken in blocks of 16, whatever the width of the machine's vectors: the 16 points of a block have at most
// 16 parents and 16 codes, so that one shuffle of 16 bytes finds them.
constexpr std::size_t kBlock = 16;

#if HWY_TARGET == HWY_SCALAR

// 16 bytes side by side, for processors without anything better.
struct Lanes {
    std::uint8_t lane[kBlock];
};

template <class Operation> HWY_INLINE Lanes for_lanes(Operation &&operation) {
    Lanes result;
    for (std::size_t i = 0; i < kBlock; ++i)
        result.lane[i] = static_cast<std::uint8_t>(operation(i));
    return result;
}

HWY_INLINE Lanes set(std::uint8_t value) {
    return for_lanes([&](std::size_t) { return value; });
}
HWY_INLINE Lanes load(const std::uint8_t *from) {
    return for_lanes([&](std::size_t i) { return from[i]; });
}
HWY_INLINE void store(Lanes a, std::uint8_t *to) { std::memcpy(to, a.lane, kBlock); }
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
// Lane i becomes lane i + kLanes.
template <int kLanes> HWY_INLINE Lanes shift_lanes(Lanes a) {
    return for_lanes([&](std::size_t i) { return i < kLanes ? 0 : a.lane[i - kLanes]; });
}
// 255 where lanes are equal.
HWY_INLINE Lanes equal_bytes(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] == b.lane[i] ? 255 : 0; });
}
// table[index]; 0 where an index has bit 7 set
HWY_INLINE Lanes lookup(Lanes table, Lanes index) {
    return for_lanes([&](std::size_t i) { return index.lane[i] > 127 ? 0 : table.lane[index.lane[i] & 15]; });
}
// Bit i set: lanes i are equal.
HWY_INLINE unsigned equal_lanes(Lanes a, Lanes b) {
    unsigned bits = 0;
    for (unsigned i = 0; i < kBlock; ++i)
        bits |= (a.lane[i] == b.lane[i] ? 1U : 0U) << i;
    return bits;
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
    for (std::size_t i = 0; i < kBlock; ++i) {
        to[2 * i] = a.lane[i];
        to[2 * i + 1] = b.lane[i];
    }
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, Lanes c, std::uint8_t *to) {
    for (std::size_t i = 0; i < kBlock; ++i) {
        to[3 * i] = a.lane[i];
        to[3 * i + 1] = b.lane[i];
        to[3 * i + 2] = c.lane[i];
    }
}

#else

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::Full128<std::uint8_t>;
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
// Lane i becomes lane i + kLanes.
template <int kLanes> HWY_INLINE Lanes shift_lanes(Lanes a) { return {hn::ShiftLeftBytes<kLanes>(Tag(), a.v)}; }
// 255 where lanes are equal.
HWY_INLINE Lanes equal_bytes(Lanes a, Lanes b) { return {hn::VecFromMask(Tag(), hn::Eq(a.v, b.v))}; }
// table[index]; 0 where an index has bit 7 set
HWY_INLINE Lanes lookup(Lanes table, Lanes index) { return {hn::TableLookupBytesOr0(table.v, index.v)}; }
// Bit i set: lanes i are equal.
HWY_INLINE unsigned equal_lanes(Lanes a, Lanes b) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(Tag(), hn::Eq(a.v, b.v), bits);
    return bits[0] | static_cast<unsigned>(bits[1]) << 8;
}
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

// Walks over the blocks of a chunk.
class Blocks {
  public:
    explicit Blocks(const SiblingLayout &layout) : block_(layout.blocks().data()), points_(layout.points()) {}

    bool done() const { return at_ >= points_; }
    void next() {
        at_ += kBlock;
        ++block_;
    }
    std::size_t at() const { return at_; }
    std::size_t count() const { return std::min(kBlock, points_ - at_); }

    // Values of the points' parent nodes.
    Lanes of_parents(const Bytes &nodes) const {
        return lookup(load(nodes.data() + block_->first_node), load(block_->parent.data()));
    }
    // Codes of the points; 0 for only children.
    Lanes of_codes(ByteView codes) const {
        return lookup(load(codes.data() + block_->first_code), load(block_->code.data()));
    }
    std::size_t node_of(std::size_t point) const { return block_->first_node + block_->parent[point]; }

  private:
    const SiblingBlock *block_;
    std::size_t points_, at_ = 0;
};

HWY_INLINE Lanes unzigzag(Lanes code) { return shift_right<1>(code) ^ (set(0) - (code & set(1))); }
HWY_INLINE std::uint8_t unzigzag(unsigned code) { return static_cast<std::uint8_t>(code >> 1 ^ (0U - (code & 1U))); }

// Writes a whole block, or the part of it that there is.
HWY_INLINE void store(Lanes values, const Blocks &block, std::uint8_t *points) {
    if (block.count() == kBlock)
        return store(values, points + block.at());
    std::uint8_t last[kBlock];
    store(values, last);
    std::memcpy(points + block.at(), last, block.count());
}

unsigned count_lanes(unsigned bits) { return static_cast<unsigned>(std::popcount(bits)); }

MaskSummary summarise_masks(ByteView masks) {
    MaskSummary summary;
    std::size_t at = 0;
    for (; at + kBlock <= masks.size(); at += kBlock) {
        const Lanes block = load(masks.data() + at);
        std::array<std::uint64_t, 2> halves{};
        std::memcpy(halves.data(), masks.data() + at, kBlock);
        summary.children += static_cast<unsigned>(std::popcount(halves[0]) + std::popcount(halves[1]));
        summary.only_children += count_lanes(equal_lanes(block & (block - set(1)), set(0)));
        summary.zero |= equal_lanes(block, set(0)) != 0;
    }
    for (; at < masks.size(); ++at) {
        summary.children += static_cast<unsigned>(std::popcount(masks[at]));
        summary.only_children += (masks[at] & (masks[at] - 1U)) == 0 ? 1U : 0U;
        summary.zero |= masks[at] == 0;
    }
    return summary;
}

// Bits 0..7 of each point's node; eight at a time, of which the next node overwrites those that are not its own.
void number_parents(ByteView masks, std::uint8_t *parents) {
    constexpr std::uint64_t kOnes = 0x0101010101010101;
    for (std::size_t node = 0; node < masks.size(); ++node) {
        const std::uint64_t nodes = (node & 255) * kOnes;
        std::memcpy(parents, &nodes, 8);
        parents += std::popcount(masks[node]);
    }
}

// Points have siblings if one of their neighbours has the same parent. `parents` has one byte before and kSlack behind.
void lay_out_siblings(const std::uint8_t *parents, std::span<SiblingBlock> blocks) {
    std::uint32_t first_node = 0, first_code = 0;
    for (SiblingBlock &block : blocks) {
        const Lanes parent = load(parents);
        const Lanes siblings = equal_bytes(parent, load(parents - 1)) | equal_bytes(parent, load(parents + 1));
        const Lanes one = siblings & set(1);
        Lanes codes = one; // up to each point, it included
        codes = codes + shift_lanes<1>(codes);
        codes = codes + shift_lanes<2>(codes);
        codes = codes + shift_lanes<4>(codes);
        codes = codes + shift_lanes<8>(codes);
        block.first_node = first_node;
        block.first_code = first_code;
        store((parent - set(parents[0])) & set(15), block.parent.data());
        std::uint8_t counts[kBlock];
        store(codes, counts);
        store(((codes - one) & set(15)) | (set(128) - (siblings & set(128))), block.code.data());
        first_node += static_cast<std::uint8_t>(parents[kBlock] - parents[0]);
        first_code += counts[kBlock - 1];
        parents += kBlock;
    }
}

EscapeCount count_escapes(ByteView codes) {
    std::size_t low = 0, whole = 0, at = 0;
    for (; at + kBlock <= codes.size(); at += kBlock) {
        const Lanes block = load(codes.data() + at);
        low += count_lanes(equal_lanes(block & set(15), set(15)));
        whole += count_lanes(equal_lanes(block, set(15)));
    }
    for (; at < codes.size(); ++at) {
        low += (codes[at] & 15) == 15 ? 1U : 0U;
        whole += codes[at] == 15 ? 1U : 0U;
    }
    return {low, low == whole};
}

// Of each parent node its cell when mirrored into the positive octant, and the bits that mirror it back: octant and
// two-sided. Writes whole blocks.
void split_parents(std::span<const std::uint16_t> parents, std::uint8_t *us, std::uint8_t *vs, std::uint8_t *mirrors) {
    const std::uint16_t *cells = normal_cells().data();
    for (std::size_t node = 0; node < parents.size(); node += kBlock) {
        std::uint16_t parent[kBlock] = {}, cell[kBlock];
        std::memcpy(parent, parents.data() + node, sizeof *parent * std::min(kBlock, parents.size() - node));
        for (std::size_t i = 0; i < kBlock; ++i)
            cell[i] = cells[parent[i] & 1023];
        Lanes low, high;
        load_interleaved(reinterpret_cast<const std::uint8_t *>(cell), low, high);
        store(low & set(127), us + node);
        store(shift_left<1>(high) | shift_right<7>(low), vs + node);
        load_interleaved(reinterpret_cast<const std::uint8_t *>(parent), low, high);
        store(shift_right<2>(high) & set(15), mirrors + node);
    }
}

bool unfilter_normals(UnfilterScratch &scratch, std::span<const std::uint16_t> parents, ByteView codes,
                      ByteView escapes, std::span<std::uint16_t> points, NormalOccurrence &occurs) {
    const std::uint16_t *normals = normals_of_cells().data();
    auto &[us, vs, mirrors] = scratch.nodes;
    split_parents(parents, us.data(), vs.data(), mirrors.data());
    const std::uint8_t *escape = escapes.data();
    bool valid = true;
    std::uint16_t cell[kBlock], mirror[kBlock], last[kBlock];
    for (Blocks block(scratch.layout); !block.done(); block.next()) {
        const Lanes code = block.of_codes(codes);
        const Lanes low = code & set(15);
        const Lanes u = (block.of_parents(us) + unzigzag(low)) & set(127);
        const Lanes v = (block.of_parents(vs) + unzigzag(shift_right<4>(code))) & set(63);
        // u + 128 v from bytes: the low byte takes v's lowest bit, the high byte the others.
        store_interleaved(u | shift_left<7>(v), shift_right<1>(v), reinterpret_cast<std::uint8_t *>(cell));
        store_interleaved(set(0), shift_left<2>(block.of_parents(mirrors)), reinterpret_cast<std::uint8_t *>(mirror));

        for (unsigned left = equal_lanes(low, set(15)); left != 0; left &= left - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(left));
            if (i >= block.count())
                break;
            const std::size_t node = block.node_of(i);
            valid &= escape[1] < 64;
            const unsigned to_u = (us[node] + unzigzag(escape[0] & 127U)) & 127U;
            const unsigned to_v = (vs[node] + unzigzag(static_cast<unsigned>(escape[1]))) & 63U;
            cell[i] = static_cast<std::uint16_t>(to_u | to_v << 7);
            mirror[i] = static_cast<std::uint16_t>(mirror[i] ^ (escape[0] >> 7) * kTwoSidedBit);
            escape += 2;
        }
        const bool whole = block.count() == kBlock;
        std::uint16_t *to = whole ? points.data() + block.at() : last;
        for (std::size_t i = 0; i < kBlock; ++i)
            to[i] = static_cast<std::uint16_t>(normals[cell[i]] ^ mirror[i]);
        for (std::size_t i = 0, count = block.count(); i < count; ++i)
            occurs[to[i] & kNormalIndexMask] = 1;
        if (!whole)
            std::memcpy(points.data() + block.at(), last, sizeof *last * block.count());
    }
    return valid;
}

void unfilter_colours_888(UnfilterScratch &scratch, ByteView parents, ByteView green, ByteView red_blue,
                          ByteView escapes, std::span<std::uint8_t> points) {
    auto &[reds, greens, blues] = scratch.nodes;
    std::size_t node = 0;
    for (; 3 * (node + kBlock) <= parents.size(); node += kBlock) {
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
    std::uint8_t last[3 * kBlock];
    for (Blocks block(scratch.layout); !block.done(); block.next()) {
        const Lanes change = unzigzag(block.of_codes(green)), pair = block.of_codes(red_blue);
        const Lanes low = pair & set(15);
        const Lanes r = block.of_parents(reds) + change + unzigzag(low);
        const Lanes g = block.of_parents(greens) + change;
        const Lanes b = block.of_parents(blues) + change + unzigzag(shift_right<4>(pair));
        std::uint8_t *to = points.data() + 3 * block.at();
        const bool whole = block.count() == kBlock;
        store_interleaved(r, g, b, whole ? to : last);
        if (!whole)
            std::memcpy(to, last, 3 * block.count());
        for (unsigned left = equal_lanes(low, set(15)); left != 0; left &= left - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(left));
            if (i >= block.count())
                break;
            const std::size_t parent = block.node_of(i);
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
    for (; 2 * (node + kBlock) <= parents.size(); node += kBlock) {
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
    std::uint8_t last[2 * kBlock];
    for (Blocks block(scratch.layout); !block.done(); block.next()) {
        const Lanes code = block.of_codes(green), pair = block.of_codes(red_blue);
        const Lanes low = pair & set(15);
        const Lanes sign = set(0) - (code & set(1));
        const Lanes half = (shift_right<2>(code + set(1)) ^ sign) - sign;
        Lanes r = block.of_parents(reds) + half + unzigzag(low);
        Lanes b = block.of_parents(blues) + half + unzigzag(shift_right<4>(pair));
        const Lanes g = (block.of_parents(greens) + unzigzag(code)) & set(63);
        if (unsigned left = equal_lanes(low, set(15)); left != 0) {
            std::uint8_t red[kBlock], blue[kBlock], halves[kBlock];
            store(r, red);
            store(b, blue);
            store(half, halves);
            for (; left != 0; left &= left - 1) {
                const auto i = static_cast<std::size_t>(std::countr_zero(left));
                if (i >= block.count())
                    break;
                const std::size_t parent = block.node_of(i);
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
        std::uint8_t *to = points.data() + 2 * block.at();
        const bool whole = block.count() == kBlock;
        store_interleaved(lower, high, whole ? to : last);
        if (!whole)
            std::memcpy(to, last, 2 * block.count());
    }
}

void unfilter_materials(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    std::copy(parents.begin(), parents.end(), nodes.begin());
    for (Blocks block(scratch.layout); !block.done(); block.next())
        store(block.of_parents(nodes) ^ block.of_codes(codes), block, points.data());
}

void unfilter_textures(UnfilterScratch &scratch, ByteView parents, ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    std::copy(parents.begin(), parents.end(), nodes.begin());
    for (Blocks block(scratch.layout); !block.done(); block.next())
        store(block.of_parents(nodes) + unzigzag(block.of_codes(codes)), block, points.data());
}

void unfilter_radii(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                    ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    for (std::size_t node = 0; node < parents.size(); ++node)
        nodes[node] = predictions[parents[node]];
    for (Blocks block(scratch.layout); !block.done(); block.next())
        store(block.of_parents(nodes) - load(codes.data() + block.at()), block, points.data());
}

void unfilter_shadows(UnfilterScratch &scratch, ByteView parents, const std::array<std::uint8_t, 256> &predictions,
                      unsigned bits, ByteView codes, std::span<std::uint8_t> points) {
    Bytes &nodes = scratch.nodes[0];
    for (std::size_t node = 0; node < parents.size(); ++node)
        nodes[node] = predictions[parents[node]];
    const Lanes wheel = set(static_cast<std::uint8_t>((1U << bits) - 1));
    for (Blocks block(scratch.layout); !block.done(); block.next()) {
        const Lanes code = load(codes.data() + block.at());
        store((block.of_parents(nodes) + code) & wheel, block, points.data());
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(summarise_masks);
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

void SiblingLayout::build(ByteView masks, const MaskSummary &summary) {
    assert(!summary.zero);
    nodes_ = masks.size();
    points_ = summary.children;
    codes_ = points_ - summary.only_children;
    parents_.resize(std::max(parents_.size(), 1 + points_ + kSlack));
    blocks_.resize(std::max(blocks_.size(), blocks().size()));
    std::uint8_t *parents = parents_.data() + 1;
    HWY_DYNAMIC_DISPATCH(number_parents)(masks, parents);
    // Neighbours of the first and of the last point that are no siblings.
    parents[-1] = static_cast<std::uint8_t>(parents[0] - 1);
    parents[points_] = static_cast<std::uint8_t>(parents[points_ - 1] + 1);
    HWY_DYNAMIC_DISPATCH(lay_out_siblings)(parents, {blocks_.data(), blocks().size()});
}

EscapeCount count_escapes(ByteView codes) { return HWY_DYNAMIC_DISPATCH(count_escapes)(codes); }

namespace {

void make_room(UnfilterScratch &scratch) {
    for (Bytes &nodes : scratch.nodes)
        nodes.resize(std::max(nodes.size(), scratch.layout.nodes() + kSlack));
}

} // namespace

bool unfilter_normals(UnfilterScratch &scratch, std::span<const std::uint16_t> parents, ByteView codes,
                      ByteView escapes, std::span<std::uint16_t> points, NormalOccurrence &occurs) {
    make_room(scratch);
    return HWY_DYNAMIC_DISPATCH(unfilter_normals)(scratch, parents, codes, escapes, points, occurs);
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
