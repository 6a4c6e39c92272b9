#include "pbm_format/chunks/normal_cone.h"

#include <algorithm>
#include <cstring>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_format/chunks/normal_cone.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// outside[i] becomes nonzero if n . axis < least for the normal n of index i. Octants are mirror images, so the
// products of one octant's coordinates serve all. `quarters` holds normal 4 i + j of the first octant at
// [j][coordinate][i]: the signs of four differences, combined in a word, are the bytes of four normals.
void compare_with_axis(const std::int32_t *quarters, const IntegerNormal &axis, std::int32_t least,
                       std::uint8_t *outside) {
    constexpr std::size_t kOctant = kNormalCount / 8, kQuarter = kOctant / 4;
    const hn::ScalableTag<std::int32_t> d;
    using Vector = hn::Vec<decltype(d)>;
    const Vector limit = hn::Set(d, least);
    for (std::size_t i = 0; i < kQuarter; i += hn::Lanes(d)) {
        Vector sum[4], difference[4], above[4], below[4]; // of x and y; z and -z minus the limit
        for (std::size_t j = 0; j < 4; ++j) {
            const auto product = [&](std::size_t c) {
                return hn::Mul(hn::LoadU(d, quarters + (3 * j + c) * kQuarter + i), hn::Set(d, axis[c]));
            };
            const Vector x = product(0), y = product(1), z = product(2);
            sum[j] = hn::Add(x, y);
            difference[j] = hn::Sub(x, y);
            above[j] = hn::Sub(z, limit);
            below[j] = hn::Sub(hn::Neg(z), limit);
        }
        const auto store = [&](std::size_t octant, auto &&less) {
            const Vector low = hn::Or(hn::And(hn::ShiftRight<24>(less(0)), hn::Set(d, 0x80)),
                                      hn::And(hn::ShiftRight<16>(less(1)), hn::Set(d, 0x8000)));
            const Vector high = hn::Or(hn::And(hn::ShiftRight<8>(less(2)), hn::Set(d, 0x800000)),
                                       hn::And(less(3), hn::Set(d, INT32_MIN)));
            std::int32_t words[hn::MaxLanes(d)];
            hn::StoreU(hn::Or(low, high), d, words);
            std::memcpy(outside + octant * kOctant + 4 * i, words, sizeof(std::int32_t) * hn::Lanes(d));
        };
        store(0, [&](std::size_t j) { return hn::Add(above[j], sum[j]); });
        store(1, [&](std::size_t j) { return hn::Sub(above[j], difference[j]); });
        store(2, [&](std::size_t j) { return hn::Add(above[j], difference[j]); });
        store(3, [&](std::size_t j) { return hn::Sub(above[j], sum[j]); });
        store(4, [&](std::size_t j) { return hn::Add(below[j], sum[j]); });
        store(5, [&](std::size_t j) { return hn::Sub(below[j], difference[j]); });
        store(6, [&](std::size_t j) { return hn::Add(below[j], difference[j]); });
        store(7, [&](std::size_t j) { return hn::Sub(below[j], sum[j]); });
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(compare_with_axis);

namespace {

// Integer normals of the first octant in the layout of compare_with_axis.
std::vector<std::int32_t> first_octant() {
    constexpr std::size_t kQuarter = kNormalCount / 8 / 4;
    std::vector<std::int32_t> quarters;
    for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t i = 0; i < kQuarter; ++i)
                quarters.push_back(integer_normal_table()[4 * i + j][c]);
    return quarters;
}

std::int32_t min_product(const NormalCone &cone) { return cone.cosine * 32767; }

// Minimum cosine between one-sided normals and the axis, x 32,767, rounded down; at most 32,767.
std::int32_t min_cosine(std::uint16_t axis_index, std::span<const std::uint16_t> normals) {
    const std::span<const IntegerNormal> table = integer_normal_table();
    const IntegerNormal axis = table[axis_index];
    std::int32_t least = 32767 * 32767;
    for (const std::uint16_t normal : normals) {
        const IntegerNormal &n = table[normal & kNormalIndexMask];
        least = std::min(least, axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2]);
    }
    return least >= 0 ? least / 32767 : (least - 32766) / 32767;
}

} // namespace

void mark_outside(const NormalCone &cone, OutsideCone &outside) {
    static const std::vector<std::int32_t> quarters = first_octant();
    HWY_DYNAMIC_DISPATCH(compare_with_axis)
    (quarters.data(), integer_normal_table()[cone.axis], min_product(cone), outside.data());
    std::fill(outside.begin() + kTwoSidedBit, outside.end(), std::uint8_t{1}); // two-sided: visible from anywhere
}

bool cone_holds(const NormalCone &cone, std::span<const std::uint16_t> normals, OutsideCone &memory) {
    if (normals.size() >= kManyNormals) {
        mark_outside(cone, memory);
        unsigned outside = 0;
        for (const std::uint16_t normal : normals)
            outside |= memory[normal & (kNormalIndexMask | kTwoSidedBit)];
        return outside == 0;
    }
    const std::span<const IntegerNormal> table = integer_normal_table();
    const IntegerNormal axis = table[cone.axis];
    return std::all_of(normals.begin(), normals.end(), [&](std::uint16_t normal) {
        const IntegerNormal &n = table[normal & kNormalIndexMask];
        return (normal & kTwoSidedBit) == 0 && axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2] >= min_product(cone);
    });
}

NormalCone bound_normals(std::span<const std::uint16_t> normals) {
    std::array<std::int64_t, 3> sum{};
    for (const std::uint16_t stored : normals) {
        if ((stored & kTwoSidedBit) != 0)
            return {};
        const IntegerNormal &n = integer_normal_table()[stored & kNormalIndexMask];
        for (std::size_t c = 0; c < 3; ++c)
            sum[c] += n[c];
    }
    NormalCone cone;
    cone.axis = quantise_normal(sum);
    const std::int32_t cosine = min_cosine(cone.axis, normals);
    if (cosine <= kNoCone)
        return {};
    cone.cosine = static_cast<std::int16_t>(cosine);
    return cone;
}

Value needed_cosine(const NormalCone &cone, std::span<const std::uint16_t> normals) {
    if (std::any_of(normals.begin(), normals.end(), [](std::uint16_t normal) { return (normal & kTwoSidedBit) != 0; }))
        return "no cone: a point is two-sided";
    return min_cosine(cone.axis, normals);
}

} // namespace pbm
#endif // HWY_ONCE
