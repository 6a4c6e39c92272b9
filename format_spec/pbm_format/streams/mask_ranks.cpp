#include "pbm_format/streams/mask_ranks.h"

#include "pbm_format/model/normal.h"
#include "pbm_format/streams/packed_rankings.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <memory>

namespace pbm {

namespace {

constexpr std::size_t kMasks = 256;
constexpr std::size_t kSymmetries = 48; // 8 * order of the axes + mirrored axes (bit 0 x, bit 1 y, bit 2 z)
constexpr unsigned kPlaceShift = 7;     // context = normal class << 10 | place << 7 | parent's mask >> 1
constexpr unsigned kNearbyBits = 10;
constexpr std::size_t kNearby = 1 << kNearbyBits; // pairs of place and parent's mask

// format_spec/mask_ranks.txt
constexpr std::uint8_t kBytes[] = {
#include "mask_ranks.inc"
};

#ifdef __EMSCRIPTEN__ // pages download WebAssembly
const MaskRankTable &rank_table() {
    static constexpr PackedRankings kPacked{std::to_array(kBytes)};
    static const MaskRankTable table = kPacked.unpacked();
    return table;
}
#else
constexpr MaskRankTable kTable = std::to_array(kBytes);
constexpr const MaskRankTable &rank_table() { return kTable; }
#endif

const std::uint8_t *ranking_of_contexts() { return rank_table().data(); }
const std::uint8_t *masks_of_rankings() { return rank_table().data() + kMaskContexts; } // [ranking][code]

using AxisOrder = std::array<std::size_t, 3>;
// In ascending order; if several sort a normal, the first is taken.
constexpr std::array<AxisOrder, 6> kAxisOrders{
    {AxisOrder{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

// Image of child `place`: mirrored first, then bit i of the image is the bit of axis order[i].
std::uint8_t place_image(std::size_t place, std::size_t symmetry) {
    const AxisOrder &order = kAxisOrders[symmetry / 8];
    const std::size_t mirrored = place ^ symmetry % 8;
    std::size_t image = 0;
    for (std::size_t i = 0; i < 3; ++i)
        image |= (mirrored >> order[i] & 1) << i;
    return static_cast<std::uint8_t>(image);
}

// The lower part of a context before its symmetry is known: place << 7 | (parent's mask, mirrored so that the place
// becomes corner 0) >> 1. Zero is place 0 of parent mask 1.
using Surroundings = std::uint16_t;

// The class of a normal and the order of its axes, shifted so that they can be added to an index.
struct SortedNormal {
    std::uint16_t normal_class = 0; // << kNearbyBits
    std::uint16_t order = 0;        // << kNearbyBits
};

struct SymmetryTables {
    std::array<std::uint8_t, kSymmetries * kMasks> image{}, original{}; // [symmetry][mask], of masks
    std::array<SortedNormal, 1024> normal{};                            // by index bits 0..9
    std::array<Surroundings, 6 * kNearby> turned{}; // [order of the axes][surroundings whose place is mirrored]
    // For each parent mask, the surroundings of its children in order.
    std::array<std::array<Surroundings, 8>, kMasks> children{};
    std::array<std::uint8_t, kMasks> child_count{};

    SymmetryTables() {
        for (std::size_t s = 0; s < kSymmetries; ++s)
            fill_images(s);
        for (std::size_t mask = 0; mask < kMasks; ++mask)
            for (std::uint8_t p = 0; p < 8; ++p)
                if ((mask >> p & 1) != 0)
                    children[mask][child_count[mask]++] = surroundings(p, image[p * kMasks + mask]);
        for (std::size_t order = 0; order < kAxisOrders.size(); ++order)
            for (std::size_t place = 0; place < 8; ++place)
                for (std::size_t mask = 1; mask < kMasks; mask += 2)
                    turned[order * kNearby + surroundings(place, mask)] =
                        surroundings(place_image(place, 8 * order), image[8 * order * kMasks + mask]);
        for (std::size_t digits = 0; digits < normal.size(); ++digits)
            normal[digits] = sort_normal(static_cast<std::uint16_t>(digits));
    }

  private:
    static Surroundings surroundings(std::size_t place, std::size_t mask) {
        return static_cast<Surroundings>(place << kPlaceShift | mask >> 1);
    }

    void fill_images(std::size_t symmetry) {
        std::array<std::uint8_t, 8> bit{};
        for (std::size_t p = 0; p < 8; ++p)
            bit[p] = static_cast<std::uint8_t>(1U << place_image(p, symmetry));
        for (std::size_t mask = 1; mask < kMasks; ++mask) {
            const std::uint8_t all = image[symmetry * kMasks + (mask & (mask - 1))] | bit[lowest_bit(mask)];
            image[symmetry * kMasks + mask] = all;
            original[symmetry * kMasks + all] = static_cast<std::uint8_t>(mask);
        }
    }

    static std::size_t lowest_bit(std::size_t mask) { return static_cast<std::size_t>(std::countr_zero(mask)); }

    static SortedNormal sort_normal(std::uint16_t digits) {
        const std::array<int, 3> c = normal_lattice_sum(digits);
        std::size_t sorted = 0;
        while (c[kAxisOrders[sorted][0]] < c[kAxisOrders[sorted][1]] ||
               c[kAxisOrders[sorted][1]] < c[kAxisOrders[sorted][2]])
            ++sorted;
        const AxisOrder &order = kAxisOrders[sorted];
        const int u = 6 * c[order[1]] / (c[order[0]] + 1), v = 6 * c[order[2]] / (c[order[0]] + 1);
        return {static_cast<std::uint16_t>(kNearby * static_cast<std::size_t>(u * (u + 1) / 2 + v)),
                static_cast<std::uint16_t>(kNearby * sorted)};
    }
};

const SymmetryTables &symmetries() {
    static const SymmetryTables instance;
    return instance;
}

// A PlacedMask as indices of tables.
struct Lookup {
    std::size_t context = 0;
    std::size_t images = 0; // symmetry x kMasks
};

inline Lookup look_up(const SymmetryTables &tables, Surroundings parent, std::size_t normal) {
    const SortedNormal sorted = tables.normal[normal & 1023U];
    const std::size_t symmetry = sorted.order | (normal >> 3 & 7U << kPlaceShift);
    // This number is both the symmetry and, combined with the parent's surroundings, the index into `turned`.
    return {.context = sorted.normal_class | std::size_t{tables.turned[symmetry ^ parent]}, .images = 2 * symmetry};
}

// Calls visit(i, lookup) for every node, i ascending. `visit` is a copy, so that its pointers stay in registers.
// Working in blocks keeps surroundings in the first-level cache and the loops free of branches that depend on data.
template <class Visit> void for_each_node(const MaskContext &context, const Visit visit) {
    constexpr std::size_t kBlock = 1024;
    const SymmetryTables &tables = symmetries();
    const ByteView parents = context.parent_masks;
    const std::uint16_t *const normals = context.node_normals.data();
    const std::size_t nodes = context.node_normals.size();
    std::array<Surroundings, kBlock + 8> block{};
    for (std::size_t first = 0, parent = 0; first < nodes;) {
        std::size_t filled = 0;
        for (; filled < kBlock && parent < parents.size(); ++parent) {
            const std::uint8_t mask = parents[parent];
            std::memcpy(&block[filled], &tables.children[mask], sizeof(tables.children[mask]));
            filled += tables.child_count[mask];
        }
        if (filled == 0) { // no more parents
            filled = kBlock;
            block.fill(0);
        }
        const std::size_t end = first + std::min(filled, nodes - first);
        for (const Surroundings *surroundings = block.data(); first < end; ++first)
            visit(first, look_up(tables, *surroundings++, normals[first]));
    }
}

// Codes of the images of masks: [ranking][mask].
using CodeTable = std::array<std::array<std::uint8_t, kMasks>, kMaskRankings>;

const CodeTable &code_table() {
    static const std::unique_ptr<const CodeTable> instance = [] {
        auto codes = std::make_unique<CodeTable>();
        for (std::size_t ranking = 0; ranking < kMaskRankings; ++ranking)
            for (std::size_t code = 0; code < kMasks; ++code)
                (*codes)[ranking][masks_of_rankings()[ranking * kMasks + code]] = static_cast<std::uint8_t>(code);
        return codes;
    }();
    return *instance;
}

} // namespace

void rank_masks(ByteView masks, const MaskContext &context, std::span<std::uint8_t> codes) {
    assert(masks.size() == codes.size() && context.node_normals.size() == codes.size());
    const auto visit = [code_of = code_table().data(), ranking_of = ranking_of_contexts(),
                        image = symmetries().image.data(), from = masks.data(),
                        to = codes.data()](std::size_t i, Lookup at) {
        to[i] = code_of[ranking_of[at.context]][image[at.images | from[i]]];
    };
    for_each_node(context, visit);
}

void unrank_masks(std::span<const std::uint8_t> codes, const MaskContext &context, std::span<std::uint8_t> masks) {
    assert(masks.size() == codes.size() && context.node_normals.size() == codes.size());
    const auto visit = [ranking_of = ranking_of_contexts(), mask_of = masks_of_rankings(),
                        original = symmetries().original.data(), from = codes.data(),
                        to = masks.data()](std::size_t i, Lookup at) {
        to[i] = original[at.images | mask_of[ranking_of[at.context] * kMasks + from[i]]];
    };
    for_each_node(context, visit);
}

void place_masks(const MaskContext &context, std::span<PlacedMask> placed) {
    assert(context.node_normals.size() == placed.size());
    for_each_node(context, [to = placed.data()](std::size_t i, Lookup at) {
        to[i] = {static_cast<std::uint16_t>(at.context), static_cast<std::uint8_t>(at.images / kMasks)};
    });
}

std::uint8_t mask_image(std::uint8_t mask, std::uint8_t symmetry) {
    assert(symmetry < kSymmetries);
    return symmetries().image[symmetry * kMasks + mask];
}

ByteView mask_rank_table() { return rank_table(); }

} // namespace pbm
