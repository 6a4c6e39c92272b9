#include "pbm_format/chunks/brick_index.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_format/chunks/brick_index.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "system/simd/target_gaps.h"

#ifndef PBM_FORMAT_BRICK_INDEX_TABLE
#define PBM_FORMAT_BRICK_INDEX_TABLE
namespace pbm {

// Integer normals, each in one word: x, y, z and 0 in 16 bits each, x lowest.
struct NormalWords {
    std::array<std::uint64_t, kNormalCount> words{};

    NormalWords() {
        for (std::size_t index = 0; index < kNormalCount; ++index)
            for (std::size_t axis = 0; axis < 3; ++axis)
                words[index] |= std::uint64_t{static_cast<std::uint16_t>(integer_normal_table()[index][axis])}
                                << 16 * axis;
    }
};

// The NormalWords of a brick's points, padded with zeros to whole SIMD vectors.
inline constexpr std::size_t kMaxBrickPoints = 512, kMaxWords = 8; // of a vector
struct BrickNormals {
    alignas(64) std::array<std::uint64_t, kMaxBrickPoints + kMaxWords> words;
};

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Number of the triangle of 6.1.2 in the direction s; 0 for the zero vector. |s| < 2^25. BVG.md 5.11.3
HWY_INLINE std::uint16_t triangle_of(const std::array<std::int32_t, 3> &s) {
    std::int32_t a = 32 * std::abs(s[0]), b = 32 * std::abs(s[1]), c = 32 * std::abs(s[2]);
    auto half = static_cast<std::int32_t>((std::int64_t{a} + b + c) / 2);
    unsigned digits = 0;
    for (int digit = 0; digit < 5; ++digit, half /= 2) {
        const bool at_x = a > half, at_y = b > half, at_z = c > half; // at most one
        digits = digits << 2 | (at_x ? 1U : 0U) | (at_y ? 2U : 0U) | (at_z ? 3U : 0U);
        const std::int32_t flip = at_x || at_y || at_z ? 0 : -1; // middle triangle: half - a, ...
        a = ((a ^ flip) - flip) + ((at_x ? -half : 0) + (half & flip));
        b = ((b ^ flip) - flip) + ((at_y ? -half : 0) + (half & flip));
        c = ((c ^ flip) - flip) + ((at_z ? -half : 0) + (half & flip));
    }
    return static_cast<std::uint16_t>((s[0] < 0 ? 1U << 10 : 0U) | (s[1] < 0 ? 1U << 11 : 0U) |
                                      (s[2] < 0 ? 1U << 12 : 0U) | digits);
}

// Sums over a brick's points.
struct PointSums {
    std::array<std::int32_t, 3> normal; // sum
    std::uint8_t largest_radius;
    bool two_sided;
};

HWY_INLINE std::uint8_t largest_of(const std::uint8_t *radii, std::size_t count) {
    const hn::CappedTag<std::uint8_t, 16> d;
    const std::size_t lanes = hn::Lanes(d);
    if (count < lanes)
        return std::accumulate(radii, radii + count, std::uint8_t{0},
                               [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); });
    auto largest = hn::LoadU(d, radii + count - lanes); // overlaps the last whole vector
    for (std::size_t i = 0; i + lanes <= count; i += lanes)
        largest = hn::Max(largest, hn::LoadU(d, radii + i));
    return largest_byte(d, largest);
}

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE std::array<std::int32_t, 3> coordinates_of(std::uint64_t word) {
    const auto at = [&](int axis) { return std::int32_t{static_cast<std::int16_t>(word >> 16 * axis)}; };
    return {at(0), at(1), at(2)};
}

HWY_INLINE std::array<std::int32_t, 3> sum_normals(const BrickNormals &normals, std::size_t count) {
    std::array<std::int32_t, 3> sum{};
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
            sum[axis] += coordinates_of(normals.words[i])[axis];
    return sum;
}

HWY_INLINE std::int32_t min_product(const BrickNormals &normals, std::size_t count, std::uint64_t axis) {
    const auto [axis_x, axis_y, axis_z] = coordinates_of(axis);
    std::int32_t least = 32767 * 32767;
    for (std::size_t i = 0; i < count; ++i) {
        const auto [x, y, z] = coordinates_of(normals.words[i]);
        least = std::min(least, x * axis_x + y * axis_y + z * axis_z);
    }
    return least;
}
#else
using Halves = hn::CappedTag<std::int32_t, 2 * kMaxWords>; // two of a word
using Words = hn::Repartition<std::uint64_t, Halves>;

// The coordinates of some normals: x and z alternately, and y and 0 alternately.
struct Coordinates {
    hn::Vec<Halves> xz, y0;
};
HWY_INLINE Coordinates coordinates_of(hn::Vec<Words> words) {
    const auto halves = hn::BitCast(Halves(), words);
    return {hn::ShiftRight<16>(hn::ShiftLeft<16>(halves)), hn::ShiftRight<16>(halves)};
}

HWY_INLINE std::array<std::int32_t, 3> sum_normals(const BrickNormals &normals, std::size_t count) {
    const Halves d;
    const Words dw;
    Coordinates sum{hn::Zero(d), hn::Zero(d)};
    for (std::size_t i = 0; i < count; i += hn::Lanes(dw)) {
        const Coordinates some = coordinates_of(hn::Load(dw, &normals.words[i]));
        sum = {hn::Add(sum.xz, some.xz), hn::Add(sum.y0, some.y0)};
    }
    const auto x0 = hn::And(sum.xz, hn::BitCast(d, hn::Set(dw, 0xFFFFFFFF)));
    return {hn::GetLane(hn::SumOfLanes(d, x0)), hn::GetLane(hn::SumOfLanes(d, sum.y0)),
            hn::GetLane(hn::SumOfLanes(d, hn::Xor(sum.xz, x0)))};
}

HWY_INLINE std::int32_t min_product(const BrickNormals &normals, std::size_t count, std::uint64_t axis) {
    const Halves d;
    const Words dw;
    const Coordinates along = coordinates_of(hn::Set(dw, axis));
    const auto most = hn::Set(d, 32767 * 32767);
    auto least = most;
    for (std::size_t i = 0; i < count; i += hn::Lanes(dw)) {
        const Coordinates some = coordinates_of(hn::Load(dw, &normals.words[i]));
        const auto parts = hn::Add(hn::Mul(along.xz, some.xz), hn::Mul(along.y0, some.y0));
        const auto product = hn::Add(parts, hn::Shuffle2301(parts));
        least = hn::Min(least, hn::IfThenElse(hn::FirstN(d, 2 * (count - i)), product, most));
    }
    return hn::GetLane(hn::MinOfLanes(d, least));
}
#endif

// Sums the `count` points at `stored` and `radii`; lists their normals in `to`. One load per point: gathers are slower.
HWY_INLINE PointSums gather_points(const NormalWords &table, const std::uint16_t *HWY_RESTRICT stored,
                                   const std::uint8_t *HWY_RESTRICT radii, std::size_t count, BrickNormals &to) {
    unsigned bits = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const unsigned normal = stored[i];
        bits |= normal;
        to.words[i] = table.words[normal & kNormalIndexMask];
    }
    std::fill_n(&to.words[count], kMaxWords, 0);
    return {.normal = sum_normals(to, count),
            .largest_radius = largest_of(radii, count),
            .two_sided = (bits & kTwoSidedBit) != 0};
}

// Computes cone, flags and largest radius of a brick's 1..512 points.
HWY_INLINE void bound_points(const NormalWords &table, const PointSums &points, const BrickNormals &normals,
                             std::size_t count, BrickRecord &to) {
    NormalCone cone;
    if (!points.two_sided) {
        const std::uint16_t axis = triangle_of(points.normal);
        const std::int32_t least = min_product(normals, count, table.words[axis]);
        const std::int32_t cosine = least / 32767 - (least % 32767 < 0 ? 1 : 0); // rounded down
        if (cosine > kNoCone)
            cone = {.axis = axis, .cosine = static_cast<std::int16_t>(cosine)};
    }
    to.cone_axis = cone.axis;
    to.cone_cosine = cone.cosine;
    to.largest_radius = points.largest_radius;
    to.flags = points.two_sided ? kTwoSidedBrick : std::uint8_t{0};
}

// Number of set bits in the first `count` of `masks`.
HWY_INLINE std::size_t count_points(ByteView masks, std::size_t count) {
    std::size_t points = 0, i = 0;
    std::uint64_t eight = 0;
    for (; i + 8 <= count; i += 8) {
        std::memcpy(&eight, masks.data() + i, 8);
        points += static_cast<std::size_t>(std::popcount(eight));
    }
    if (i == count)
        return points;
    if (i + 8 <= masks.size()) {
        std::memcpy(&eight, masks.data() + i, 8);
        return points + static_cast<std::size_t>(std::popcount(eight << 8 * (8 - (count - i))));
    }
    for (; i < count; ++i)
        points += static_cast<std::size_t>(std::popcount(masks[i]));
    return points;
}

bool fill_bricks(const NormalWords &table, ByteView masks, std::span<const std::uint16_t> normals, ByteView radii,
                 std::span<BrickRecord> to) {
    BrickNormals gathered;
    std::size_t node = 0, point = 0;
    for (BrickRecord &brick : to) {
        const auto nodes = static_cast<std::size_t>(std::popcount(brick.node_map));
        if (masks.size() - node < nodes)
            return false;
        const std::size_t points = count_points(masks.subspan(node), nodes);
        if (normals.size() - point < points)
            return false;
        brick.first_node = static_cast<std::uint16_t>(node);
        brick.first_point = static_cast<std::uint16_t>(point);
        bound_points(table, gather_points(table, normals.data() + point, radii.data() + point, points, gathered),
                     gathered, points, brick);
        node += nodes;
        point += points;
    }
    return node == masks.size() && point == normals.size();
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(fill_bricks);

BrickParents brick_parents(const ChunkEntry &entry, const ChunkEntry &above, std::span<const BrickRecord> bricks,
                           ByteView masks) {
    assert(entry.first_parent >= above.first_node);
    return {.bricks = bricks, .masks = masks, .first = static_cast<std::size_t>(entry.first_parent - above.first_node)};
}

namespace {

// Iterates over the occupied octants of the bricks above: a brick of level L - 1 is a node of level L - 4, whose
// children are bricks of level L. Byte k of its node map holds the nodes of level L - 2 in child k; each has a mask.
class OctantWalk {
  public:
    explicit OctantWalk(const BrickParents &parents) : parents_(parents) {
        const auto after =
            std::upper_bound(parents.bricks.begin(), parents.bricks.end(), parents.first,
                             [](std::size_t first, const BrickRecord &brick) { return first < brick.first_node; });
        brick_ = std::max<std::size_t>(static_cast<std::size_t>(after - parents.bricks.begin()), 1) - 1;
        if (brick_ < parents.bricks.size())
            node_ = parents.bricks[brick_].first_node;
    }

    std::size_t node() const { return node_; } // first mask of the next octant

    // Writes position and node map of the next occupied octant, a brick of the level below; returns false at the end.
    bool next(BrickRecord &to) {
        for (; brick_ < parents_.bricks.size(); ++brick_, octant_ = 0) {
            const BrickRecord &above = parents_.bricks[brick_];
            while (octant_ < 8) {
                const unsigned k = octant_++;
                auto occupied = static_cast<unsigned>(above.node_map >> 8 * k & 255);
                if (occupied == 0)
                    continue;
                if (node_ + 8 > parents_.masks.size() &&
                    node_ + static_cast<std::size_t>(std::popcount(occupied)) > parents_.masks.size())
                    return false;
                to.x = static_cast<std::uint16_t>(2U * above.x + (k & 1));
                to.y = static_cast<std::uint16_t>(2U * above.y + (k >> 1 & 1));
                to.z = static_cast<std::uint16_t>(2U * above.z + (k >> 2));
                to.node_map = 0;
                for (; occupied != 0; occupied &= occupied - 1)
                    to.node_map |= std::uint64_t{parents_.masks[node_++]} << 8 * std::countr_zero(occupied);
                return true;
            }
        }
        return false;
    }

  private:
    const BrickParents &parents_;
    std::size_t brick_ = 0, node_ = 0;
    unsigned octant_ = 0;
};

// Writes x, y, z and node_map of every record.
bool place_bricks(const BrickParents &parents, const ChunkShape &shape, std::span<BrickRecord> to) {
    if (shape.parents == 0) { // level 1: the cube itself, which holds the one node of level 0
        to[0].x = to[0].y = to[0].z = 0;
        to[0].node_map = 1;
        return to.size() == 1;
    }
    OctantWalk walk(parents);
    BrickRecord before;
    while (walk.node() < parents.first)
        if (!walk.next(before))
            return false;
    if (walk.node() != parents.first)
        return false;
    for (BrickRecord &brick : to)
        if (!walk.next(brick))
            return false;
    return walk.node() == parents.first + shape.parents;
}

// Whether a brick lies below the chunk's root. Bricks ascend, so testing the first and the last one suffices.
bool below_root(const ChunkShape &shape, int brick_level, const BrickRecord &brick) {
    return morton_encode(brick.x, brick.y, brick.z) >> 3 * (brick_level - shape.root_depth) == shape.root_prefix;
}

} // namespace

bool index_bricks(const BrickParents &parents, const ChunkShape &shape, int level, ByteView masks,
                  std::span<const std::uint16_t> normals, ByteView radii, std::span<BrickRecord> to) {
    assert(to.size() == shape.bricks && !to.empty() && normals.size() == radii.size());
    const int brick_level = std::max(0, level - 3);
    if (!place_bricks(parents, shape, to) || !below_root(shape, brick_level, to.front()) ||
        !below_root(shape, brick_level, to.back()))
        return false;
    return bound_bricks(masks, normals, radii, to);
}

bool bound_bricks(ByteView masks, std::span<const std::uint16_t> normals, ByteView radii, std::span<BrickRecord> to) {
    static const NormalWords &table = *new NormalWords; // as the tables of normal.cpp
    return HWY_DYNAMIC_DISPATCH(fill_bricks)(table, masks, normals, radii, to);
}

} // namespace pbm
#endif
