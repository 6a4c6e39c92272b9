#include "pbm_render/surface_offsets.h"

#include "pbm_bake/padded_brick.h"
#include "pbm_format/normal.h"
#include "pbm_format/octree.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/surface_offsets.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#ifndef PBM_RENDER_SURFACE_OFFSETS_TABLES
#define PBM_RENDER_SURFACE_OFFSETS_TABLES
namespace pbm {

// In a padded brick: of the first voxel of the brick itself.
inline constexpr std::size_t kFirstInside = kPaddedSlice + kPaddedEdge + 1;
inline constexpr std::size_t kBrickPoints = 512, kBorderPoints = 1000 - kBrickPoints;

// Normals x 32,767 in voxels of a padded brick; 0 where there is no point. Loads of whole vectors reach beyond the end.
struct PaddedNormals {
    alignas(64) std::array<std::array<std::int16_t, 1024>, 3> planes;
};

// The 27 voxels around one, in 32 lanes: three slices that follow each other, of each three rows 10 apart, so that
// three loads from a padded brick and two blends give all of them. Lanes 9, 19 and the last three count for nothing.
inline constexpr std::size_t kLanes = 32;
struct Directions {
    alignas(64) std::array<std::array<std::int16_t, kLanes>, 3> way;  // -1, 0, 1 x 8,192
    alignas(64) std::array<std::array<std::int16_t, kLanes>, 3> from; // all bits set: from this slice
    alignas(64) std::array<std::int16_t, kLanes> weight;              // (1.5^2 - length^2) x 2,048
};
inline constexpr Directions kDirections = [] {
    Directions all{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const int row = static_cast<int>(lane) / kPaddedEdge, column = static_cast<int>(lane) % kPaddedEdge;
        all.weight[lane] = -30000;
        if (row == 3 || column == 9)
            continue;
        const int x = column % 3 - 1, y = row - 1, z = column / 3 - 1;
        all.way[0][lane] = static_cast<std::int16_t>(8192 * x);
        all.way[1][lane] = static_cast<std::int16_t>(8192 * y);
        all.way[2][lane] = static_cast<std::int16_t>(8192 * z);
        all.from[static_cast<std::size_t>(column / 3)][lane] = -1;
        all.weight[lane] = static_cast<std::int16_t>(4608 - 2048 * (x * x + y * y + z * z));
    }
    return all;
}();

// In a padded brick.
inline constexpr std::array<std::uint16_t, 8> kPaddedChildren{0, 1, 10, 11, 100, 101, 110, 111};
inline constexpr std::array<std::uint16_t, 64> kPaddedNodes = [] {
    std::array<std::uint16_t, 64> places{};
    for (std::size_t node = 0; node < 64; ++node) {
        const auto at = morton_decode(node);
        places[node] = static_cast<std::uint16_t>(kFirstInside + 2 * (at[0] + 10 * at[1] + 100 * at[2]));
    }
    return places;
}();
// Of the children that a mask announces; then anything.
inline constexpr std::array<std::array<std::uint16_t, 8>, 256> kPaddedOfMask = [] {
    std::array<std::array<std::uint16_t, 8>, 256> places{};
    for (std::size_t mask = 0; mask < 256; ++mask)
        for (std::size_t child = 0, n = 0; child < 8; ++child)
            if ((mask >> child & 1) != 0)
                places[mask][n++] = kPaddedChildren[child];
    return places;
}();

// A side, edge or corner of a brick, towards one of the 27.
struct Border {
    std::uint64_t nodes = 0;                // of the brick, as a node map
    std::array<std::uint8_t, 4> children{}; // of each of them
    std::size_t child_count = 0;
    int step = 0;            // to the brick there, in voxels of a padded brick
    std::uint64_t place = 0; // to the brick there, in its place
};
inline constexpr std::array<Border, 27> kBorders = [] {
    std::array<Border, 27> borders{};
    for (std::size_t i = 0; i < 27; ++i) {
        Border &border = borders[i];
        const std::array<int, 3> way{static_cast<int>(i % 3) - 1, static_cast<int>(i / 3 % 3) - 1,
                                     static_cast<int>(i / 9) - 1};
        const auto touches = [&](const std::array<std::uint32_t, 3> &at, std::uint32_t last) {
            bool all = true;
            for (std::size_t axis = 0; axis < 3; ++axis)
                all &= way[axis] == 0 || at[axis] == (way[axis] < 0 ? 0 : last);
            return all;
        };
        for (std::uint64_t node = 0; node < 64; ++node)
            if (touches(morton_decode(node), 3))
                border.nodes |= std::uint64_t{1} << node;
        for (std::uint8_t child = 0; child < 8 && i != std::size_t{kMiddleBrick}; ++child)
            if (touches(morton_decode(child), 1))
                border.children[border.child_count++] = child;
        border.step = 8 * (way[0] + 10 * way[1] + 100 * way[2]);
        border.place = static_cast<std::uint64_t>(way[0]) + (static_cast<std::uint64_t>(way[1]) << 16) +
                       (static_cast<std::uint64_t>(way[2]) << 32);
    }
    return borders;
}();

struct ShortNormal {
    std::int16_t x = 0, y = 0, z = 0, none = 0;
};
inline const std::array<ShortNormal, kNormalCount> &short_normals() {
    static const auto kTable = [] {
        std::array<ShortNormal, kNormalCount> table{};
        for (std::size_t i = 0; i < table.size(); ++i) {
            const IntegerNormal &n = integer_normal_table()[i];
            table[i] = {static_cast<std::int16_t>(n[0]), static_cast<std::int16_t>(n[1]),
                        static_cast<std::int16_t>(n[2])};
        }
        return table;
    }();
    return kTable;
}

// The others of the 27, as bits: six sides, twelve edges, eight corners.
inline constexpr std::uint32_t kSides = 0x415410, kEdges = 0x2AA8AAA, kCorners = 0x5140145;
static_assert((kSides | kEdges | kCorners | 1U << kMiddleBrick) == 0x7FFFFFF);

// Which of them a node touches, and which a mask's children do of those that their node touches.
inline constexpr std::array<std::uint32_t, 64> kWaysOfNode = [] {
    std::array<std::uint32_t, 64> ways{};
    for (std::size_t way = 0; way < 27; ++way)
        for (std::size_t node = 0; node < 64 && way != std::size_t{kMiddleBrick}; ++node)
            ways[node] |= static_cast<std::uint32_t>(kBorders[way].nodes >> node & 1) << way;
    return ways;
}();
inline constexpr std::array<std::uint32_t, 256> kWaysOfMask = [] {
    std::array<std::uint32_t, 256> ways{};
    for (std::size_t mask = 0; mask < 256; ++mask)
        for (std::size_t way = 0; way < 27; ++way)
            for (std::size_t i = 0; i < kBorders[way].child_count; ++i)
                ways[mask] |= static_cast<std::uint32_t>(mask >> kBorders[way].children[i] & 1) << way;
    return ways;
}();

// What there is of a chunk to look up.
struct ChunkPoints {
    const std::uint32_t *nodes;
    const std::uint16_t *normals;
    const ShortNormal *table;
};

struct BrickScratch {
    PaddedNormals around;
    std::array<std::uint16_t, kBrickPoints + 8> places;  // of its points in `around`
    std::array<std::uint32_t, kBorderPoints + 1> border; // points of its neighbours
    std::array<std::uint16_t, kBorderPoints + 1> border_places;
    std::array<std::int32_t, kBrickPoints + 16> offsets, weights;
    std::array<std::int8_t, kBrickPoints + 16> steps;
};

// Neighbours with points beside those of a brick: sides, then edges, then corners.
struct BrickNeighbours {
    std::array<const SurfaceOffsets::Brick *, 26> bricks;
    std::array<std::uint8_t, 26> ways; // to them, of 27
    std::array<std::size_t, 3> ends;   // of sides, edges, corners
};

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Shorts = hn::CappedTag<std::int16_t, kLanes>;
#if HWY_TARGET == HWY_SCALAR
using Wides = hn::Rebind<std::int32_t, Shorts>;
#else
using Wides = hn::RepartitionToWide<Shorts>;
#endif
using WideVector = hn::Vec<Wides>;

// Sums over the voxels around one.
struct Sums {
    WideVector offsets, weights; // to be summed over lanes: weight x offset x 8,192; weights x 4,608
};

HWY_INLINE Sums sum_around(const PaddedNormals &around, std::size_t at) {
    const Shorts d;
    const Wides wide;
    Sums sums{hn::Zero(wide), hn::Zero(wide)};
    WideVector more_offsets = hn::Zero(wide), more_weights = hn::Zero(wide);
    const auto own = [&](std::size_t axis) { return hn::Set(d, around.planes[axis][at]); };
    const auto x = own(0), y = own(1), z = own(2);
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
        const auto constant = [&](const std::array<std::int16_t, kLanes> &of) { return hn::LoadU(d, &of[lane]); };
        const auto others = [&](std::size_t axis) {
            const std::int16_t *const from = &around.planes[axis][at + lane - kFirstInside];
            const auto second = hn::MaskFromVec(constant(kDirections.from[1]));
            const auto third = hn::MaskFromVec(constant(kDirections.from[2]));
            const auto two = hn::IfThenElse(second, hn::LoadU(d, from + kPaddedSlice - 3), hn::LoadU(d, from));
            return hn::IfThenElse(third, hn::LoadU(d, from + 2 * kPaddedSlice - 6), two);
        };
        const auto other_x = others(0), other_y = others(1), other_z = others(2);
        const auto cosine =
            hn::SaturatedAdd(hn::SaturatedAdd(hn::MulFixedPoint15(x, other_x), hn::MulFixedPoint15(y, other_y)),
                             hn::MulFixedPoint15(z, other_z));
        const auto along_way = [&](auto nx, auto ny, auto nz) { // x 8,192
            return hn::Add(hn::Add(hn::MulFixedPoint15(nx, constant(kDirections.way[0])),
                                   hn::MulFixedPoint15(ny, constant(kDirections.way[1]))),
                           hn::MulFixedPoint15(nz, constant(kDirections.way[2])));
        };
        const auto along = along_way(x, y, z);
        const auto both = hn::Add(along, along_way(other_x, other_y, other_z));
        // 1 / (1 + cosine), within 0.0006 from 0.5 to 1: (0.4311 cosine - 0.7087)^2 + 0.4229
        const auto root = hn::Add(hn::MulFixedPoint15(cosine, hn::Set(d, 14127)), hn::Set(d, -23223));
        const auto inverse = hn::Add(hn::MulFixedPoint15(root, root), hn::Set(d, 13859));
        const auto offset = hn::MulFixedPoint15(both, inverse);
        const auto in_reach =
            hn::Max(hn::Add(hn::MulFixedPoint15(along, along), constant(kDirections.weight)), hn::Zero(d));
        const auto weight = hn::IfThenElseZero(hn::Gt(cosine, hn::Set(d, 16383)), in_reach);
        sums.offsets = hn::ReorderWidenMulAccumulate(wide, weight, offset, sums.offsets, more_offsets);
        sums.weights = hn::ReorderWidenMulAccumulate(wide, weight, hn::Set(d, 1), sums.weights, more_weights);
    }
    return {hn::Add(sums.offsets, more_offsets), hn::Add(sums.weights, more_weights)};
}

#if HWY_TARGET != HWY_SCALAR
// The lanes of a vector of four sums each become four.
template <class D> HWY_INLINE void store_folded(D d, hn::Vec<D> v, std::int32_t *to) {
    if constexpr (hn::MaxLanes(D()) > 4) {
        const hn::Half<D> half;
        store_folded(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)), to);
    } else {
        hn::StoreU(v, d, to);
    }
}
#endif

// Sums of the lanes of each.
HWY_INLINE void store_sums(WideVector a, WideVector b, WideVector c, WideVector d, std::int32_t *to) {
#if HWY_TARGET == HWY_SCALAR
    to[0] = hn::GetLane(a);
    to[1] = hn::GetLane(b);
    to[2] = hn::GetLane(c);
    to[3] = hn::GetLane(d);
#else
    const Wides wide;
    const hn::RepartitionToWide<Wides> pairs;
    const auto add = [&](WideVector v, WideVector w) {
        return hn::BitCast(pairs, hn::Add(hn::InterleaveLower(wide, v, w), hn::InterleaveUpper(wide, v, w)));
    };
    const auto ab = add(a, b), cd = add(c, d);
    store_folded(wide,
                 hn::Add(hn::BitCast(wide, hn::InterleaveLower(pairs, ab, cd)),
                         hn::BitCast(wide, hn::InterleaveUpper(pairs, ab, cd))),
                 to);
#endif
}

HWY_INLINE std::size_t list_places(const SurfaceOffsets::Brick &brick, const std::uint32_t *nodes,
                                   BrickScratch &scratch) {
    const hn::CappedTag<std::uint16_t, 8> d;
    std::size_t points = 0;
    const std::uint32_t *node = nodes + brick.first_node;
    for (std::uint64_t map = brick.node_map; map != 0; map &= map - 1, ++node) {
        const auto first = hn::Set(d, kPaddedNodes[static_cast<std::size_t>(std::countr_zero(map))]);
        const std::uint32_t mask = *node & 255;
        for (std::size_t i = 0; i < 8; i += hn::Lanes(d))
            hn::StoreU(hn::Add(first, hn::LoadU(d, &kPaddedOfMask[mask][i])), d, &scratch.places[points + i]);
        points += kChildren[mask];
    }
    return points;
}

HWY_INLINE void put(const ShortNormal &normal, std::size_t at, PaddedNormals &to) {
    to.planes[0][at] = normal.x;
    to.planes[1][at] = normal.y;
    to.planes[2][at] = normal.z;
}

// Lists the points of `brick` that touch the side where it has `border`, of `children` per node, behind `count` others.
template <std::size_t children>
HWY_INLINE std::size_t list_border(const SurfaceOffsets::Brick &brick, const Border &border, const std::uint32_t *nodes,
                                   std::size_t count, BrickScratch &scratch) {
    for (std::uint64_t map = brick.node_map & border.nodes; map != 0; map &= map - 1) {
        const int node = std::countr_zero(map);
        const std::uint64_t before = brick.node_map & ((std::uint64_t{1} << node) - 1);
        const std::uint32_t entry = nodes[brick.first_node + static_cast<std::size_t>(std::popcount(before))];
        const std::uint32_t mask = entry & 255, first = entry >> 8;
        const int corner = kPaddedNodes[static_cast<std::size_t>(node)] - border.step;
        for (std::size_t i = 0; i < children; ++i) { // those that are not there are overwritten: no branch to guess
            const unsigned child = border.children[i];
            scratch.border[count] = first + kChildren[mask & ((1U << child) - 1)];
            scratch.border_places[count] = static_cast<std::uint16_t>(corner + kPaddedChildren[child]);
            count += mask >> child & 1;
        }
    }
    return count;
}

HWY_INLINE void gather_borders(const BrickNeighbours &around, const ChunkPoints &chunk, BrickScratch &scratch) {
    std::size_t count = 0;
    const auto list = [&](std::size_t first, std::size_t last, auto children) {
        for (std::size_t i = first; i < last; ++i)
            count = list_border<decltype(children)::value>(*around.bricks[i], kBorders[26U - around.ways[i]],
                                                           chunk.nodes, count, scratch);
    };
    list(0, around.ends[0], std::integral_constant<std::size_t, 4>());
    list(around.ends[0], around.ends[1], std::integral_constant<std::size_t, 2>());
    list(around.ends[1], around.ends[2], std::integral_constant<std::size_t, 1>());
    for (std::size_t i = 0; i < count; ++i)
        put(chunk.table[chunk.normals[scratch.border[i]] & kNormalIndexMask], scratch.border_places[i], scratch.around);
}

void estimate_brick(const SurfaceOffsets::Brick &brick, const BrickNeighbours &around, const ChunkPoints &chunk,
                    BrickScratch &scratch, std::int8_t *to) {
    const Shorts shorts;
    for (auto &plane : scratch.around.planes)
        for (std::size_t i = 0; i < plane.size(); i += hn::Lanes(shorts))
            hn::Store(hn::Zero(shorts), shorts, &plane[i]);
    const std::size_t points = list_places(brick, chunk.nodes, scratch);
    const std::uint16_t *const own = chunk.normals + brick.first_point;
    for (std::size_t i = 0; i < points; ++i)
        put(chunk.table[own[i] & kNormalIndexMask], scratch.places[i], scratch.around);
    gather_borders(around, chunk, scratch);
    std::fill_n(&scratch.places[points], 3, static_cast<std::uint16_t>(kFirstInside));
    for (std::size_t i = 0; i < points; i += 4) {
        const auto sums = [&](std::size_t n) { return sum_around(scratch.around, scratch.places[i + n]); };
        const Sums a = sums(0), b = sums(1), c = sums(2), d = sums(3);
        store_sums(a.offsets, b.offsets, c.offsets, d.offsets, &scratch.offsets[i]);
        store_sums(a.weights, b.weights, c.weights, d.weights, &scratch.weights[i]);
    }
    const hn::CappedTag<float, 16> f;
    const hn::RebindToSigned<decltype(f)> w;
    const hn::Rebind<std::int8_t, decltype(f)> bytes;
    for (std::size_t i = 0; i < points; i += hn::Lanes(f)) {
        const auto offset = hn::ConvertTo(f, hn::LoadU(w, &scratch.offsets[i]));
        const auto weight = hn::ConvertTo(f, hn::Max(hn::LoadU(w, &scratch.weights[i]), hn::Set(w, 1)));
        const auto steps = hn::Div(hn::Mul(offset, hn::Set(f, kOffsetSteps / 8192)), weight);
        const auto within = hn::Min(hn::Max(steps, hn::Set(f, -127)), hn::Set(f, 127));
        hn::StoreU(hn::DemoteTo(bytes, hn::ConvertTo(w, hn::Add(within, hn::CopySign(hn::Set(f, 0.5F), within)))),
                   bytes, &scratch.steps[i]);
    }
    std::int8_t *const offsets = to + brick.first_point; // bytes might be anything's, for all the compiler knows
    for (std::size_t i = 0; i < points; ++i)
        offsets[i] = static_cast<std::int8_t>((own[i] & kTwoSidedBit) != 0 ? 0 : scratch.steps[i]);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(estimate_brick);

namespace {

std::size_t hash(std::uint64_t place) { return place * 0x9E3779B97F4A7C15U >> 40; }

} // namespace

void SurfaceOffsets::list_bricks(const ChunkView &chunk) {
    bricks_.clear();
    nodes_.clear();
    table_.assign(std::bit_ceil(2 * chunk.bricks.size() + 1), 0);
    for (const BrickRecord &record : chunk.bricks) {
        const BrickRecord brick = record; // bytes of a mapped chunk may change
        Brick listed{.place = brick.x | std::uint64_t{brick.y} << 16 | std::uint64_t{brick.z} << 32,
                     .node_map = brick.node_map,
                     .first_node = static_cast<std::uint32_t>(nodes_.size()),
                     .first_point =
                         std::min(std::uint32_t{brick.first_point}, static_cast<std::uint32_t>(chunk.normals.size()))};
        std::size_t point = listed.first_point, node = brick.first_node;
        for (std::uint64_t map = brick.node_map; map != 0; map &= map - 1, ++node) {
            const std::uint32_t mask = node < chunk.masks.size() ? chunk.masks[node] : 0;
            const std::size_t next = point + kChildren[mask];
            const bool fits = next <= chunk.normals.size();
            if (fits)
                listed.ways |= kWaysOfNode[static_cast<std::size_t>(std::countr_zero(map))] & kWaysOfMask[mask];
            nodes_.push_back(static_cast<std::uint32_t>(point << 8 | (fits ? mask : 0)));
            point = fits ? next : point;
        }
        bricks_.push_back(listed);
        std::size_t slot = hash(listed.place) & (table_.size() - 1);
        while (table_[slot] != 0)
            slot = (slot + 1) & (table_.size() - 1);
        table_[slot] = static_cast<std::uint32_t>(bricks_.size());
    }
}

const SurfaceOffsets::Brick *SurfaceOffsets::find(std::uint64_t place) const {
    for (std::size_t slot = hash(place) & (table_.size() - 1); table_[slot] != 0;
         slot = (slot + 1) & (table_.size() - 1))
        if (const Brick &brick = bricks_[table_[slot] - 1]; brick.place == place)
            return &brick;
    return nullptr;
}

void SurfaceOffsets::find_neighbours(const Brick &brick, BrickNeighbours &to) const {
    std::size_t count = 0;
    for (std::size_t kind = 0; kind < 3; ++kind) {
        for (std::uint32_t ways = brick.ways & std::array{kSides, kEdges, kCorners}[kind]; ways != 0;
             ways &= ways - 1) {
            const int way = std::countr_zero(ways);
            const Brick *const found = find(brick.place + kBorders[static_cast<std::size_t>(way)].place);
            if (found == nullptr || (found->ways >> (26 - way) & 1) == 0)
                continue;
            to.bricks[count] = found;
            to.ways[count++] = static_cast<std::uint8_t>(way);
        }
        to.ends[kind] = count;
    }
}

void SurfaceOffsets::estimate(const ChunkView &chunk, std::span<const std::uint32_t> bricks,
                              std::span<std::int8_t> to) {
    list_bricks(chunk);
    const ChunkPoints points{nodes_.data(), chunk.normals.data(), short_normals().data()};
    BrickScratch scratch;
    BrickNeighbours around;
    for (const std::uint32_t i : bricks) {
        find_neighbours(bricks_[i], around);
        HWY_DYNAMIC_DISPATCH(estimate_brick)(bricks_[i], around, points, scratch, to.data());
    }
}

void SurfaceOffsets::estimate(const ChunkView &chunk, std::span<std::int8_t> to) {
    std::vector<std::uint32_t> bricks(chunk.bricks.size());
    std::iota(bricks.begin(), bricks.end(), 0U);
    estimate(chunk, bricks, to);
}

} // namespace pbm
#endif // HWY_ONCE
