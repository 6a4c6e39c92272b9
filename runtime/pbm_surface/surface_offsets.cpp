#include "pbm_surface/surface_offsets.h"

#include "pbm_format/model/normal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_surface/surface_offsets.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_surface/brick_neighbours.h"
#include "pbm_surface/brick_places.h"
#include "system/simd/target_gaps.h"

#ifndef PBM_SURFACE_OFFSETS_TABLES
#define PBM_SURFACE_OFFSETS_TABLES
namespace pbm {

// Array size of a brick with a layer of voxels around it. Writes of whole nodes beside its corners and reads of whole
// vectors behind its last voxel stay in bounds.
inline constexpr std::size_t kRow = 10, kSlice = 120, kPadded = 12 * kSlice + 32;
inline constexpr std::size_t kFirstInside = 2 + 2 * kRow + 2 * kSlice;
inline constexpr PaddedLayout kLayout{.row = kRow, .slice = kSlice, .first = kFirstInside};

// The 27 voxels around one in 32 lanes: lane x + 3 z + 10 y, each 0 to 2. Three loads from a padded brick and two
// blends collect them. Lanes 9, 19 and from 29 on are unused.
inline constexpr std::size_t kLanes = 32, kFirstAround = 1 + kRow + kSlice;
inline constexpr std::array<std::array<std::uint8_t, kLanes>, 2> kFromSlice =
    [] { // all bits set: the lane comes from the second, or the third slice
        std::array<std::array<std::uint8_t, kLanes>, 2> from{};
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            if (const std::size_t slice = lane % 10 / 3; slice == 1 || slice == 2)
                from[slice - 1][lane] = 255;
        return from;
    }();

// Normals with the same signs and the same first three base-4 digits share one kind, computed for their middle normal.
inline constexpr int kKindShift = 4;
struct NormalKind {
    // What each of the 27 voxels adds to the sums:
    //
    //   offset in voxels = (sum of moments / sum of weights) x kWeightScale / kMomentScale - kMomentShift
    alignas(64) std::array<std::uint8_t, kLanes> weights{}; // x kWeightScale
    std::array<std::uint8_t, kLanes> moments{};             // weight x (n.d + kMomentShift) x kMomentScale
};
inline constexpr double kMomentShift = 1.75; // n.d is at least -1.74
inline constexpr double kWeightScale = 84, kMomentScale = 24;

// The signed axes +x, -x, +y, -y, +z, -z, as bits, on which a unit normal's component exceeds `least`. Another normal
// is of the same side if its axes for kFar include one of the point's axes for kNear and none of their opposites.
// Normals up to 26 degrees apart always are of the same side, those more than 104 degrees apart never.
inline std::uint8_t ways_of(const UnitVector &normal, double least) {
    int directions = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        directions |= std::abs(normal[axis]) > least ? (normal[axis] > 0 ? 1 : 2) << (2 * axis) : 0;
    return static_cast<std::uint8_t>(directions);
}
inline constexpr double kNear = 0.38, kFar = 0.5;

struct NormalKinds {
    static constexpr std::size_t kCount = kNormalCount >> kKindShift;
    std::array<NormalKind, kCount> kinds;
    std::array<std::uint32_t, kCount> near, opposite;          // repeated in each byte
    alignas(16) std::array<std::uint8_t, kCount / 8> far_axes; // of kinds in the first octant: +x, +y, +z
    // What makes a point redundant: from the highest bit, 16 bits of the step in a padded brick from a voxel to the one
    // behind it, along the signed axis nearest to the normal; a byte of `opposite`; a byte of that axis.
    std::array<std::int32_t, kCount> behind;
};

inline NormalKind kind_of(const UnitVector &normal) {
    NormalKind kind;
    for (std::size_t lane = 0; lane < 29; ++lane) {
        const std::size_t layer = lane / 10, in_layer = lane % 10, row = in_layer / 3;
        const auto x = static_cast<double>(in_layer % 3) - 1, y = static_cast<double>(layer) - 1,
                   z = static_cast<double>(row) - 1;
        const double along = (normal[0] * x + normal[1] * y) + normal[2] * z;
        const double weight = 3 - (x * x + y * y + z * z - along * along);
        if (in_layer == 9)
            continue;
        const auto rounded = [](double value) { return static_cast<std::uint8_t>(value + 0.5); };
        kind.weights[lane] = rounded(weight * kWeightScale);
        kind.moments[lane] = rounded(weight * (along + kMomentShift) * kMomentScale);
    }
    return kind;
}

inline std::size_t longest_axis(const UnitVector &normal) {
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
        if (std::abs(normal[axis]) > std::abs(normal[longest]))
            longest = axis;
    return longest;
}

inline const NormalKinds &normal_kinds() {
    static const NormalKinds &kKinds = []() -> const NormalKinds & {
        NormalKinds &all = *new NormalKinds; // as the tables of normal.cpp
        for (std::size_t i = 0; i < all.kinds.size(); ++i) {
            const UnitVector &middle = normal_table()[i << kKindShift];
            all.kinds[i] = kind_of(middle);
            const std::uint32_t near = ways_of(middle, kNear);
            all.near[i] = 0x01010101U * near;
            all.opposite[i] = 0x01010101U * ((near & 21) << 1 | (near & 42) >> 1);
            if (i < all.far_axes.size())
                all.far_axes[i] = ways_of(middle, kFar);
            const std::size_t axis = longest_axis(middle);
            const bool positive = middle[axis] > 0;
            constexpr std::array<int, 3> kSteps{1, kRow, kSlice};
            all.behind[i] = (positive ? -kSteps[axis] : kSteps[axis]) * 0x10000 +
                            static_cast<int>((all.opposite[i] & 0xFF) << 8) + ((positive ? 1 : 2) << (2 * axis));
        }
        return all;
    }();
    return kKinds;
}

// [octant]: both bits of the axes along which its normals are negative.
alignas(16) inline constexpr std::array<std::uint8_t, 16> kNegativeAxes = [] {
    std::array<std::uint8_t, 16> negative{};
    for (unsigned octant = 0; octant < 8; ++octant)
        for (unsigned axis = 0; axis < 3; ++axis)
            negative[octant] |= static_cast<std::uint8_t>((octant >> axis & 1) * (3U << (2 * axis)));
    return negative;
}();

inline std::size_t kind_number(std::uint16_t normal) { return (normal & kNormalIndexMask) >> kKindShift; }

// Index in a padded brick of the first voxel of each node.
inline constexpr std::array<std::uint16_t, 64> kPaddedNodes = [] {
    std::array<std::uint16_t, 64> places{};
    for (std::size_t node = 0; node < 64; ++node) {
        const auto [x, y, z] = morton_decode(node);
        places[node] = static_cast<std::uint16_t>(kLayout.index({2 * x, 2 * y, 2 * z}));
    }
    return places;
}();

// [mask][child]: index of the child among the node's points; 255: none.
inline constexpr std::array<std::array<std::uint8_t, 16>, 256> kPointOfChild = [] {
    std::array<std::array<std::uint8_t, 16>, 256> points{};
    for (std::size_t mask = 0; mask < 256; ++mask) {
        std::uint8_t count = 0;
        for (std::size_t child = 0; child < 16; ++child)
            points[mask][child] = (mask >> child & 1) != 0 ? count++ : std::uint8_t{255};
    }
    return points;
}();

// A direction from a brick to a neighbour, see kDirectionCount.
struct BrickDirection {
    std::uint64_t touching = 0; // nodes of the brick on that side, as a node map
    std::uint32_t children = 0; // children of these nodes on that side, as a mask
    int step = 0;               // to the same voxel of the neighbour, in a padded brick
    std::uint64_t place = 0;    // added to the brick's place
};
inline constexpr std::array<BrickDirection, kDirectionCount> kBrickDirections = [] {
    std::array<BrickDirection, kDirectionCount> directions{};
    for (std::size_t direction = 0; direction < kDirectionCount; ++direction) {
        BrickDirection &to = directions[direction];
        for (std::uint64_t node = 0; node < 64; ++node)
            to.touching |= std::uint64_t{touches(morton_decode(node), 3, direction)} << node;
        for (std::uint32_t child = 0; child < 8; ++child)
            to.children |= std::uint32_t{touches(morton_decode(child), 1, direction)} << child;
        to.step = kLayout.step(direction);
        for (std::size_t axis = 0; axis < 3; ++axis)
            to.place += static_cast<std::uint64_t>(steps_of(direction)[axis]) << (16 * axis);
    }
    return directions;
}();

// Directions towards lower x, the same x and higher x, as bits.
inline constexpr std::array<std::uint32_t, 3> kDirectionsByX{0x1249249, 0x2492492 & ~(1U << kNoDirection), 0x4924924};

// Directions whose side a node touches, and those that a node's children touch, as bits: [node], [mask].
inline constexpr std::array<std::uint32_t, 64> kDirectionsOfNode = [] {
    std::array<std::uint32_t, 64> directions{};
    for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
        for (std::size_t node = 0; node < 64; ++node)
            directions[node] |= static_cast<std::uint32_t>(kBrickDirections[direction].touching >> node & 1)
                                << direction;
    return directions;
}();
inline constexpr std::array<std::uint32_t, 256> kDirectionsOfMask = [] {
    std::array<std::uint32_t, 256> directions{};
    for (std::size_t mask = 0; mask < 256; ++mask)
        for (std::size_t direction = 0; direction < kDirectionCount; ++direction)
            directions[mask] |= ((mask & kBrickDirections[direction].children) != 0 ? 1U : 0U) << direction;
    return directions;
}();

struct ChunkPoints {
    ByteView masks;                   // of nodes
    const std::uint16_t *node_points; // [nodes]: number of the brick's points before those of the node
    const std::uint8_t *sides;        // [points]: axes for kFar; 512 + 16 bytes more may be read
    std::span<const std::uint16_t> normals;
};

struct BrickScratch {
    alignas(64) std::array<std::uint8_t, kPadded> sides;        // of voxels of a padded brick
    BrickPlaces places;                                         // of points
    std::array<std::uint16_t, kBrickPoints + kMaxLanes> padded; // indices of points in `sides`
    std::array<std::uint16_t, kBrickPoints + kMaxLanes> normals;
    std::array<std::uint32_t, 2 * (kBrickPoints + kMaxLanes)> sums; // of weights, of moments
};
static_assert(sizeof(BrickOffsets::steps) >= kBrickPoints + kMaxLanes);

// The neighbours with points next to a brick's points, grouped as in kDirectionsByX.
struct BrickNeighbours {
    std::array<const SurfaceOffsets::Brick *, kDirectionCount> bricks;
    std::array<std::uint8_t, kDirectionCount> directions; // directions to the neighbours
    std::array<std::size_t, 3> ends;
};

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE void list_padded(std::size_t points, BrickScratch &scratch) {
    const hn::CappedTag<std::uint16_t, kMaxLanes> d;
    for (std::size_t i = 0; i < points; i += hn::Lanes(d)) {
        const auto place = hn::LoadU(d, &scratch.places.place[i]);
        const auto x = hn::And(place, hn::Set(d, 15)), y = hn::And(hn::ShiftRight<4>(place), hn::Set(d, 15)),
                   z = hn::ShiftRight<8>(place);
        const auto to = hn::Add(hn::Add(x, hn::Set(d, kFirstInside)),
                                hn::Add(hn::Mul(y, hn::Set(d, kRow)), hn::Mul(z, hn::Set(d, kSlice))));
        hn::StoreU(to, d, &scratch.padded[i]);
    }
}

// Axes for kFar of all normals. `to` is padded to whole SIMD vectors.
void list_sides(std::span<const std::uint16_t> normals, std::uint8_t *to) {
    const NormalKinds &kinds = normal_kinds();
    std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
    const hn::ScalableTag<std::uint16_t> d;
    const hn::Repartition<std::uint8_t, decltype(d)> bytes;
    const hn::Rebind<std::uint8_t, decltype(d)> halves;
    const auto table = [&](const std::uint8_t *from) { return hn::LoadDup128(bytes, from); };
    const auto look_up = [&](auto in, auto index) {
        return hn::BitCast(d, lookup_bytes(in, hn::BitCast(bytes, index)));
    };
    const auto a = table(&kinds.far_axes[0]), b = table(&kinds.far_axes[16]), c = table(&kinds.far_axes[32]),
               e = table(&kinds.far_axes[48]), signs = table(kNegativeAxes.data());
    for (; i + hn::Lanes(d) <= normals.size(); i += hn::Lanes(d)) {
        const auto stored = hn::LoadU(d, normals.data() + i);
        const auto number = hn::And(hn::ShiftRight<kKindShift>(stored), hn::Set(d, 15));
        const auto odd = hn::TestBit(stored, hn::Set(d, 16 << kKindShift));
        const auto upper = hn::TestBit(stored, hn::Set(d, 32 << kKindShift));
        const auto axes = hn::And(hn::IfThenElse(upper, hn::IfThenElse(odd, look_up(e, number), look_up(c, number)),
                                                 hn::IfThenElse(odd, look_up(b, number), look_up(a, number))),
                                  hn::Set(d, 21));
        const auto negative = look_up(signs, hn::And(hn::ShiftRight<10>(stored), hn::Set(d, 7)));
        const auto sides =
            hn::Or(hn::AndNot(negative, axes), hn::And(hn::Add(axes, axes), hn::And(negative, hn::Set(d, 63))));
        hn::StoreU(hn::DemoteTo(halves, hn::BitCast(hn::RebindToSigned<decltype(d)>(), sides)), halves, to + i);
    }
#endif
    for (; i < normals.size(); ++i) {
        const std::size_t kind = kind_number(normals[i]);
        const unsigned axes = kinds.far_axes[kind % kinds.far_axes.size()];
        const unsigned negative = kNegativeAxes[kind / kinds.far_axes.size()];
        to[i] = static_cast<std::uint8_t>((axes & ~negative) | (axes << 1 & negative));
    }
}

// Arranges the sides of a node's points by its children: a byte for each, 0 where there is no point.
HWY_INLINE std::uint64_t by_children(std::uint8_t mask, const std::uint8_t *sides) {
    const std::array<std::uint8_t, 16> &points = kPointOfChild[mask];
#if HWY_TARGET == HWY_SCALAR
    std::uint64_t word = 0;
    for (std::size_t child = 0; child < 8; ++child)
        word |= points[child] == 255 ? 0 : std::uint64_t{sides[points[child]]} << (8 * child);
    return word;
#else
    const hn::FixedTag<std::uint8_t, 16> d;
    const hn::Repartition<std::uint64_t, decltype(d)> word;
    return hn::GetLane(hn::BitCast(word, lookup_bytes(hn::LoadU(d, sides), hn::LoadU(d, points.data()))));
#endif
}

// Writes the sides of a node's children into the padded brick. kWayX: the step along x from the brick to the node's
// brick. Only children next to the brick are written.
template <int kWayX> HWY_INLINE void put_node(std::uint64_t children, std::uint8_t *to) {
    const auto put = [&](std::size_t row, int shift) {
        if constexpr (kWayX == 0) {
            const auto both = static_cast<std::uint16_t>(children >> shift);
            std::memcpy(to + row, &both, sizeof both);
        } else if constexpr (kWayX < 0) {
            to[row + 1] = static_cast<std::uint8_t>(children >> (shift + 8));
        } else {
            to[row] = static_cast<std::uint8_t>(children >> shift);
        }
    };
    put(0, 0);
    put(kRow, 16);
    put(kSlice, 32);
    put(kRow + kSlice, 48);
}

HWY_INLINE void put_brick(const SurfaceOffsets::Brick &brick, const ChunkPoints &chunk, BrickScratch &scratch) {
    const std::uint8_t *const sides = chunk.sides + brick.first_point;
    std::size_t index = brick.first_node;
    for (std::uint64_t map = brick.node_map; map != 0; map &= map - 1, ++index)
        put_node<0>(by_children(chunk.masks[index], sides + chunk.node_points[index]),
                    &scratch.sides[kPaddedNodes[static_cast<std::size_t>(std::countr_zero(map))]]);
}

// Writes those nodes of a neighbour that touch the brick. `direction` leads to the neighbour.
template <int kWayX>
HWY_INLINE void put_border(const SurfaceOffsets::Brick &brick, std::size_t direction, const ChunkPoints &chunk,
                           BrickScratch &scratch) {
    const std::uint8_t *const sides = chunk.sides + brick.first_point;
    std::uint8_t *const to = scratch.sides.data() + kBrickDirections[direction].step;
    for (std::uint64_t map = brick.node_map & kBrickDirections[opposite(direction)].touching; map != 0;
         map &= map - 1) {
        const int node = std::countr_zero(map);
        const std::uint64_t before = brick.node_map & ((std::uint64_t{1} << node) - 1);
        const std::size_t index = brick.first_node + static_cast<std::size_t>(std::popcount(before));
        put_node<kWayX>(by_children(chunk.masks[index], sides + chunk.node_points[index]),
                        to + kPaddedNodes[static_cast<std::size_t>(node)]);
    }
}

HWY_INLINE void put_neighbours(const BrickNeighbours &around, const ChunkPoints &chunk, BrickScratch &scratch) {
    const auto put = [&](std::size_t first, std::size_t last, auto direction_x) {
        for (std::size_t i = first; i < last; ++i)
            put_border<decltype(direction_x)::value>(*around.bricks[i], around.directions[i], chunk, scratch);
    };
    put(0, around.ends[0], std::integral_constant<int, -1>());
    put(around.ends[0], around.ends[1], std::integral_constant<int, 0>());
    put(around.ends[1], around.ends[2], std::integral_constant<int, 1>());
}

// For four points from `first` on, sums weights and moments of the surrounding voxels of the same side.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void sum_four(const NormalKinds &kinds, const BrickScratch &scratch, std::size_t first, std::uint32_t *to) {
    for (std::size_t i = first; i < first + 4; ++i, to += 2) {
        const std::size_t kind = kind_number(scratch.normals[i]);
        to[0] = to[1] = 0;
        for (std::size_t lane = 0; lane < 29; ++lane) {
            const std::size_t at =
                scratch.padded[i] - kFirstAround + lane % 10 % 3 + lane / 10 * kRow + lane % 10 / 3 * kSlice;
            const std::uint32_t far = scratch.sides[at];
            if (lane % 10 == 9 || (far & kinds.near[kind]) == 0 || (far & kinds.opposite[kind]) != 0)
                continue;
            to[0] += kinds.kinds[kind].weights[lane];
            to[1] += kinds.kinds[kind].moments[lane];
        }
    }
}
#else
HWY_INLINE void sum_four(const NormalKinds &kinds, const BrickScratch &scratch, std::size_t first, std::uint32_t *to) {
    const hn::CappedTag<std::uint8_t, kLanes> d;
    const hn::Repartition<std::uint32_t, decltype(d)> words;
    const hn::Repartition<std::uint64_t, decltype(d)> wide;
    const auto sums = [&](std::size_t point) { // in each lane: weights + moments x 2^32
        const std::size_t number = kind_number(scratch.normals[point]);
        const NormalKind &kind = kinds.kinds[number];
        const auto near = hn::BitCast(d, hn::Set(words, kinds.near[number])),
                   opposite = hn::BitCast(d, hn::Set(words, kinds.opposite[number]));
        auto sum = hn::Zero(wide);
        for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
            const std::uint8_t *const from = &scratch.sides[scratch.padded[point] + lane - kFirstAround];
            const auto slice = [&](std::size_t i) { return hn::MaskFromVec(hn::LoadU(d, &kFromSlice[i][lane])); };
            const auto two = hn::IfThenElse(slice(0), hn::LoadU(d, from + kSlice - 3), hn::LoadU(d, from));
            const auto far = hn::IfThenElse(slice(1), hn::LoadU(d, from + 2 * kSlice - 6), two);
            const auto same_side =
                hn::And(hn::Ne(hn::And(far, near), hn::Zero(d)), hn::Eq(hn::And(far, opposite), hn::Zero(d)));
            const auto of = [&](const std::array<std::uint8_t, kLanes> &shares) {
                return hn::SumsOf8(hn::IfThenElseZero(same_side, hn::LoadU(d, &shares[lane])));
            };
            sum = hn::Add(sum, hn::Add(of(kind.weights), hn::ShiftLeft<32>(of(kind.moments))));
        }
        return sum;
    };
    const auto pair = [&](std::size_t point) {
        const auto a = sums(point), b = sums(point + 1);
        return hn::Add(hn::InterleaveLower(wide, a, b), hn::InterleaveUpper(wide, a, b));
    };
    const auto one = pair(first), other = pair(first + 2);
    if constexpr (hn::MaxLanes(wide) == 4) {
        const auto both = hn::Add(hn::ConcatLowerLower(wide, other, one), hn::ConcatUpperUpper(wide, other, one));
        hn::StoreU(hn::BitCast(words, both), words, to);
    } else {
        hn::StoreU(hn::BitCast(words, one), words, to);
        hn::StoreU(hn::BitCast(words, other), words, to + 4);
    }
}
#endif

// Of the points whose voxels are at `padded`: which have a point of nearly the same direction behind them.
template <class D>
HWY_INLINE hn::Mask<D> have_point_behind(D d, const NormalKinds &kinds, hn::Vec<D> normals, hn::Vec<D> padded,
                                         const BrickScratch &scratch) {
    const hn::RebindToUnsigned<D> words;
    const auto kind = hn::ShiftRight<kKindShift>(hn::And(normals, hn::Set(d, kNormalIndexMask)));
    const auto behind = hn::GatherIndex(d, kinds.behind.data(), kind);
    const auto at = hn::Add(padded, hn::ShiftRight<16>(behind));
    const auto four =
        hn::GatherIndex(d, reinterpret_cast<const std::int32_t *>(scratch.sides.data()), hn::ShiftRight<2>(at));
    const auto shift = hn::ShiftLeft<3>(hn::And(at, hn::Set(d, 3)));
    const auto sides = hn::BitCast(d, hn::Shr(hn::BitCast(words, four), hn::BitCast(words, shift)));
    const auto same = hn::And(hn::And(sides, behind), hn::Set(d, 0xFF));
    const auto other = hn::And(hn::And(sides, hn::ShiftRight<8>(behind)), hn::Set(d, 0xFF));
    return hn::And(hn::Ne(same, hn::Zero(d)), hn::Eq(other, hn::Zero(d)));
}

// offset = moments / weights, in 1 / kOffsetSteps, rounded to even numbers; and kRedundantBit.
HWY_INLINE void find_offsets(const NormalKinds &kinds, std::size_t points, const BrickScratch &scratch,
                             BrickOffsets &to) {
    const hn::CappedTag<float, kMaxLanes> d;
    const hn::RebindToUnsigned<decltype(d)> words;
    const hn::RebindToSigned<decltype(d)> integers;
    const hn::Rebind<std::uint16_t, decltype(d)> halves;
    const hn::Rebind<std::int8_t, decltype(d)> bytes;
    constexpr auto kScale = static_cast<float>(kWeightScale / kMomentScale * kOffsetSteps),
                   kShift = static_cast<float>(kMomentShift * kOffsetSteps),
                   kLift = static_cast<float>(kLayerLift / kWeightScale * kOffsetSteps);
    constexpr auto kRedundantSteps = static_cast<std::int32_t>(kRedundantDepth * kOffsetSteps);
    constexpr auto kOneSurface = static_cast<std::int32_t>(kOneSurfaceWeight * kWeightScale);
    for (std::size_t i = 0; i < points; i += hn::Lanes(d)) {
        hn::Vec<decltype(words)> weights, moments;
        hn::LoadInterleaved2(words, &scratch.sums[2 * i], weights, moments);
        const auto real = [&](auto sum) { return hn::ConvertTo(d, hn::BitCast(integers, sum)); };
        const auto ratio = hn::Div(real(moments), real(hn::Max(weights, hn::Set(words, 1))));
        const auto layers = real(hn::Sub(hn::Max(weights, hn::Set(words, kOneSurface)), hn::Set(words, kOneSurface)));
        const auto steps = hn::Add(hn::Sub(hn::Mul(ratio, hn::Set(d, kScale)), hn::Set(d, kShift)),
                                   hn::Mul(layers, hn::Set(d, kLift)));
        const auto half = hn::Mul(hn::Min(hn::Max(steps, hn::Set(d, -126)), hn::Set(d, 126)), hn::Set(d, 0.5F));
        const auto rounded = hn::ConvertTo(integers, hn::Add(half, hn::CopySign(hn::Set(d, 0.5F), half)));
        const auto offset = hn::Add(rounded, rounded);
        const auto normals = hn::PromoteTo(integers, hn::LoadU(halves, &scratch.normals[i]));
        const auto padded = hn::PromoteTo(integers, hn::LoadU(halves, &scratch.padded[i]));
        const auto one_surface = hn::Lt(hn::BitCast(integers, weights), hn::Set(integers, kOneSurface + 1));
        const auto redundant = hn::And(hn::And(hn::Lt(offset, hn::Set(integers, 1 - kRedundantSteps)), one_surface),
                                       have_point_behind(integers, kinds, normals, padded, scratch));
        const auto marked = hn::Or(offset, hn::IfThenElseZero(redundant, hn::Set(integers, kRedundantBit)));
        const auto two_sided = hn::Ne(hn::And(normals, hn::Set(integers, kTwoSidedBit)), hn::Zero(integers));
        hn::StoreU(hn::DemoteTo(bytes, hn::IfThenZeroElse(two_sided, marked)), bytes, &to.steps[i]);
    }
}

void estimate_brick(const SurfaceOffsets::Brick &brick, const BrickNeighbours &around, const ChunkPoints &chunk,
                    BrickOffsets &to) {
    const NormalKinds &kinds = normal_kinds();
    BrickScratch scratch;
    const hn::CappedTag<std::uint8_t, 64> d;
    for (std::size_t i = 0; i < kPadded; i += hn::Lanes(d))
        hn::Store(hn::Zero(d), d, &scratch.sides[i]);
    const std::size_t points =
        std::min(list_places(brick.node_map, chunk.masks.subspan(brick.first_node), scratch.places),
                 chunk.normals.size() - brick.first_point);
    list_padded(points, scratch);
    std::copy_n(chunk.normals.begin() + brick.first_point, points, scratch.normals.begin()); // mapped bytes may change
    std::fill_n(&scratch.padded[points], kMaxLanes, static_cast<std::uint16_t>(kFirstInside));
    std::fill_n(&scratch.normals[points], kMaxLanes, std::uint16_t{0});
    put_brick(brick, chunk, scratch);
    put_neighbours(around, chunk, scratch);
    for (std::size_t i = 0; i < points; i += 4)
        sum_four(kinds, scratch, i, &scratch.sums[2 * i]);
    find_offsets(kinds, points, scratch, to);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(estimate_brick);
HWY_EXPORT(list_sides);

namespace {

std::size_t hash(std::uint64_t place) { return static_cast<std::size_t>(place * 0x9E3779B97F4A7C15U >> 40); }

} // namespace

void SurfaceOffsets::begin(const ChunkView &chunk) {
    bricks_.clear();
    bricks_.reserve(chunk.bricks.size() + 2);
    node_points_.resize(chunk.masks.size());
    table_.assign(std::bit_ceil(2 * chunk.bricks.size()), 0);
    bricks_.push_back({.place = ~std::uint64_t{0}}); // free slots of the table refer to it
    std::size_t total = 0;
    for (const BrickRecord &record : chunk.bricks) {
        const BrickRecord brick = record; // bytes of a mapped chunk may change
        Brick listed{
            .place = brick.x | std::uint64_t{brick.y} << 16 | std::uint64_t{brick.z} << 32,
            .first_node = std::min(std::uint32_t{brick.first_node}, static_cast<std::uint32_t>(chunk.masks.size())),
            .first_point = std::min(std::uint32_t{brick.first_point}, static_cast<std::uint32_t>(chunk.normals.size())),
            .points_before = static_cast<std::uint32_t>(total)};
        std::size_t points = 0, node = listed.first_node;
        for (std::uint64_t map = brick.node_map; map != 0 && node < chunk.masks.size(); map &= map - 1, ++node) {
            const std::uint8_t mask = chunk.masks[node];
            listed.directions |=
                kDirectionsOfNode[static_cast<std::size_t>(std::countr_zero(map))] & kDirectionsOfMask[mask];
            listed.node_map |= map & ~(map - 1);
            node_points_[node] = static_cast<std::uint16_t>(points);
            points += kChildren[mask];
        }
        if (total + points > chunk.normals.size()) { // changed bytes
            listed.node_map = listed.directions = 0;
            points = 0;
        }
        total += points;
        std::size_t slot = hash(listed.place) & (table_.size() - 1);
        while (table_[slot] != 0)
            slot = (slot + 1) & (table_.size() - 1);
        table_[slot] = static_cast<std::uint32_t>(bricks_.size());
        bricks_.push_back(listed);
    }
    bricks_.push_back({.points_before = static_cast<std::uint32_t>(total)});
    constexpr std::size_t kPadding = kBrickPoints + kMaxLanes;
    sides_ = std::make_unique_for_overwrite<std::uint8_t[]>(chunk.normals.size() + kPadding);
    std::fill_n(sides_.get() + chunk.normals.size(), kPadding, std::uint8_t{0});
    HWY_DYNAMIC_DISPATCH(list_sides)(chunk.normals, sides_.get());
}

const SurfaceOffsets::Brick &SurfaceOffsets::find(std::uint64_t place) const {
    std::size_t slot = hash(place) & (table_.size() - 1);
    while (table_[slot] != 0 && bricks_[table_[slot]].place != place)
        slot = (slot + 1) & (table_.size() - 1);
    return bricks_[table_[slot]];
}

void SurfaceOffsets::find_neighbours(const Brick &brick, BrickNeighbours &to) const {
    std::size_t count = 0;
    for (std::size_t x = 0; x < kDirectionsByX.size(); ++x) {
        for (std::uint32_t directions = brick.directions & kDirectionsByX[x]; directions != 0;
             directions &= directions - 1) {
            const auto direction = static_cast<std::size_t>(std::countr_zero(directions));
            const Brick &found = find(brick.place + kBrickDirections[direction].place);
            to.bricks[count] = &found;
            to.directions[count] = static_cast<std::uint8_t>(direction);
            count += found.directions >> opposite(direction) & 1;
        }
        to.ends[x] = count;
    }
}

void SurfaceOffsets::estimate(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &to) const {
    const Brick &listed = bricks_[brick + 1];
    BrickNeighbours around;
    find_neighbours(listed, around);
    HWY_DYNAMIC_DISPATCH(estimate_brick)
    (listed, around, {chunk.masks, node_points_.data(), sides_.get(), chunk.normals}, to);
}

void SurfaceOffsets::estimate(const ChunkView &chunk, std::span<std::int8_t> to) {
    begin(chunk);
    BrickOffsets some;
    for (std::uint32_t brick = 0; brick < chunk.bricks.size(); ++brick) {
        estimate(chunk, brick, some);
        const std::size_t before = points_before(brick);
        std::copy_n(some.steps.begin(), points_before(brick + 1) - before,
                    to.begin() + static_cast<std::ptrdiff_t>(before));
    }
}

} // namespace pbm
#endif // HWY_ONCE
