#include "pbm_build/neighbours/leaf_scan.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/neighbours/leaf_scan.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using IntTag = hn::CappedTag<std::int32_t, kFan>;
using FloatTag = hn::RebindToFloat<IntTag>;
using Ints = hn::Vec<IntTag>;

HWY_INLINE hn::Vec<FloatTag> squared_length(Ints x, Ints y, Ints z) {
    const FloatTag d;
    const auto a = hn::ConvertTo(d, x), b = hn::ConvertTo(d, y), c = hn::ConvertTo(d, z);
    return hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c));
}

HWY_INLINE std::uint32_t bits_of(hn::Mask<FloatTag> mask) {
    alignas(8) std::uint8_t bits[8] = {};
    hn::StoreMaskBits(FloatTag(), mask, bits);
    return static_cast<std::uint32_t>(bits[0] | bits[1] << 8);
}

// Stores the chosen lanes of `lengths` one behind the other, and their points: `first` + `places`. Overwrites
// whole vectors.
HWY_INLINE void append([[maybe_unused]] Ints places, Ints lengths, hn::Mask<FloatTag> chosen, std::int32_t first,
                       std::int32_t *squared, std::int32_t *points) {
    const IntTag d;
#if HWY_TARGET == HWY_AVX2 // Compress of Highway 1.0.3 copies a table of 1 KiB to the stack each time
    alignas(64) Lanes all;
    hn::Store(lengths, d, all.data());
    for (std::uint32_t bits = bits_of(chosen); bits != 0; bits &= bits - 1) {
        const std::size_t lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(bits);
        *squared++ = all[lane];
        *points++ = first + static_cast<std::int32_t>(lane);
    }
#else
    const auto which = hn::RebindMask(d, chosen);
    hn::StoreU(hn::Compress(lengths, which), d, squared);
    hn::StoreU(hn::Compress(hn::Add(places, hn::Set(d, first)), which), d, points);
#endif
}

std::uint32_t boxes_within_lanes(const Boxes &boxes, const Box &box, float limit) {
    const IntTag di;
    const FloatTag d;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < kFan; i += hn::Lanes(di)) {
        const auto gap = [&](std::size_t axis) {
            const auto a = static_cast<int>(axis);
            return hn::Max(hn::Max(hn::Sub(hn::Load(di, &boxes.low[axis][i]), hn::Set(di, box.high[a])),
                                   hn::Sub(hn::Set(di, box.low[a]), hn::Load(di, &boxes.high[axis][i]))),
                           hn::Zero(di));
        };
        bits |= bits_of(hn::Le(squared_length(gap(0), gap(1), gap(2)), hn::Set(d, limit))) << i;
    }
    return bits;
}

// Sorts by counting, for each candidate, those with smaller keys. The lowest bits of a key are the candidate's place,
// so that no two are equal.
void sort_candidates(Candidates &candidates, const std::int32_t *squared, const std::int32_t *points) {
    const IntTag d;
    constexpr std::int32_t kPlace = Candidates::kRoom - 1;
    const std::size_t count = candidates.count;
    const Ints places = hn::Iota(d, 0);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d))
        hn::Store(hn::Or(hn::AndNot(hn::Set(d, kPlace), hn::Load(d, squared + i)),
                         hn::Add(places, hn::Set(d, static_cast<std::int32_t>(i)))),
                  d, &candidates.keys[i]);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
        const auto keys = hn::Load(d, &candidates.keys[i]);
        auto rank = hn::Zero(d);
        for (std::size_t j = 0; j < count; ++j)
            rank = hn::Sub(rank, hn::VecFromMask(d, hn::Gt(keys, hn::Set(d, candidates.keys[j]))));
        alignas(64) Lanes ranks;
        hn::Store(rank, d, ranks.data());
        for (std::size_t lane = 0; lane < std::min(hn::Lanes(d), count - i); ++lane)
            candidates.points[static_cast<std::size_t>(ranks[lane])] = static_cast<std::uint32_t>(points[i + lane]);
    }
}

std::size_t points_within_lanes(const Leaf *leaves, const LeafList &near, std::size_t first, const LatticePoint &at,
                                float limit, Candidates &candidates) {
    const IntTag di;
    const FloatTag d;
    alignas(64) std::array<std::int32_t, Candidates::kRoom + kFan> squared;
    std::array<std::int32_t, Candidates::kRoom + kFan> points;
    std::size_t count = 0;
    const Ints places = hn::Iota(di, 0); // a slow operation
    const auto search = [&](std::uint32_t index) {
        const Leaf &leaf = leaves[index];
        for (std::size_t i = 0; i < kFan; i += hn::Lanes(di)) {
            const auto step = [&](std::size_t axis) {
                return hn::Sub(hn::Load(di, &leaf.at[axis][i]), hn::Set(di, at[static_cast<int>(axis)]));
            };
            const auto length = squared_length(step(0), step(1), step(2));
            const auto within = hn::Le(length, hn::Set(d, limit));
            append(places, hn::BitCast(di, length), within, static_cast<std::int32_t>(index * kFan + i),
                   &squared[count], &points[count]);
            count += hn::CountTrue(d, within);
        }
    };
    std::size_t next = first;
    while (next < near.leaves.size() && count + kFan <= Candidates::kRoom) {
        const std::size_t group = next / kFan, end = std::min(near.leaves.size(), (group + 1) * kFan);
        std::uint32_t within = boxes_within_lanes(near.boxes[group], {at, at}, limit) >> next % kFan << next % kFan;
        within &= static_cast<std::uint32_t>((std::uint64_t{1} << (end - group * kFan)) - 1);
        for (; within != 0 && count + kFan <= Candidates::kRoom; within &= within - 1)
            search(near.leaves[group * kFan + hwy::Num0BitsBelowLS1Bit_Nonzero32(within)]);
        next = within == 0 ? end : group * kFan + hwy::Num0BitsBelowLS1Bit_Nonzero32(within);
    }
    candidates.count = count;
    sort_candidates(candidates, squared.data(), points.data());
    return next;
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(boxes_within_lanes);
HWY_EXPORT(points_within_lanes);

std::uint32_t boxes_within(const Boxes &boxes, const Box &box, float limit) {
    return HWY_DYNAMIC_DISPATCH(boxes_within_lanes)(boxes, box, limit);
}

std::size_t points_within(const Leaf *leaves, const LeafList &near, std::size_t first, const LatticePoint &at,
                          float limit, Candidates &candidates) {
    return HWY_DYNAMIC_DISPATCH(points_within_lanes)(leaves, near, first, at, limit, candidates);
}

void LeafList::clear() {
    leaves.clear();
    boxes.clear();
}

void LeafList::add(std::uint32_t leaf, const Box &box) {
    const std::size_t lane = leaves.size() % kFan;
    if (lane == 0)
        boxes.emplace_back();
    leaves.push_back(leaf);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        boxes.back().low[axis][lane] = box.low[static_cast<int>(axis)];
        boxes.back().high[axis][lane] = box.high[static_cast<int>(axis)];
    }
}

} // namespace pbm::build
#endif // HWY_ONCE
