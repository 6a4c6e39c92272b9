#include "pbm_format/streams/unfilter.h"

#include <algorithm>
#include <bit>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_format/streams/unfilter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "system/simd/byte_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// Iterates over the points of a chunk, kLanes at a time.
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

// Writes a whole stride, or its part before the end.
HWY_INLINE void store(Lanes values, const Strides &stride, std::uint8_t *points) {
    if (stride.whole())
        return store(values, points + stride.at());
    std::uint8_t last[kLanes];
    store(values, last);
    std::memcpy(points + stride.at(), last, stride.count());
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

EscapeCount count_escapes(ByteView codes) {
    std::size_t count = 0, at = 0;
    unsigned strange = 0; // low half 15 but high half not 0
    for (; at + kLanes <= codes.size(); at += kLanes) {
        const Lanes some = load(codes.data() + at);
        const unsigned escapes = equal_lanes(some & set(15), set(15));
        count += count_lanes(escapes);
        strange |= escapes ^ equal_lanes(some, set(15));
    }
    for (; at < codes.size(); ++at) {
        const bool escape = (codes[at] & 15) == 15;
        count += escape ? 1U : 0U;
        strange |= escape && codes[at] != 15 ? 1U : 0U;
    }
    return {count, strange == 0};
}

// Cells (u, v) of the normals of the positive octant.
struct PositiveCells {
    std::array<std::uint8_t, 1024> u{}, v{};

    PositiveCells() {
        for (std::size_t i = 0; i < u.size(); ++i) {
            u[i] = static_cast<std::uint8_t>(normal_cells()[i] & 127);
            v[i] = static_cast<std::uint8_t>(normal_cells()[i] >> 7);
        }
    }
};

// For each parent node: its cell when mirrored into the positive octant; its octant and two-sided bits, to mirror back.
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
        // u + 128 v as bytes: the lowest bit of v belongs to the low byte, the others to the high byte.
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
        if (!whole) // repeat the first one past the end
            for (std::size_t i = stride.count(); i < kLanes; ++i) {
                cell[i] = cell[0];
                mirror[i] = mirror[0];
            }
        for (std::size_t eight = 0; eight < kLanes; eight += 8) { // eight, so that compilers unroll the inner loop
            std::uint8_t marks_of_eight = 0;
            for (std::size_t i = eight; i < eight + 8; i += 2) { // two per store
                std::uint32_t mirrors_of_both;
                std::memcpy(&mirrors_of_both, mirror + i, sizeof mirrors_of_both);
                const std::uint32_t both =
                    (normals[cell[i]] | static_cast<std::uint32_t>(normals[cell[i + 1]]) << 16) ^ mirrors_of_both;
                std::memcpy(to + i, &both, sizeof both);
                if constexpr (kCompares) // indices stay below 2 x kNormalCount for any bytes
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
        // High byte: red, then green's high half. Low byte: green's low half, then blue.
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
    const Lanes value_bits = set(static_cast<std::uint8_t>((1U << bits) - 1));
    for (Strides stride(scratch.layout); !stride.done(); stride.next()) {
        const Lanes code = load(codes.data() + stride.at());
        store((stride.of_parents(nodes) + code) & value_bits, stride, points.data());
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(largest_value);
HWY_EXPORT(count_escapes);
HWY_EXPORT(unfilter_normals);
HWY_EXPORT(unfilter_colours_888);
HWY_EXPORT(unfilter_colours_565);
HWY_EXPORT(unfilter_materials);
HWY_EXPORT(unfilter_textures);
HWY_EXPORT(unfilter_radii);
HWY_EXPORT(unfilter_shadows);

std::uint8_t largest_value(ByteView values) { return HWY_DYNAMIC_DISPATCH(largest_value)(values); }

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
