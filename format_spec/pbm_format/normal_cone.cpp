#include "pbm_format/normal_cone.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_format/normal_cone.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// outside[i]: whether n . axis < least for the normal n of index i, whose coordinates lie in `normals`.
void compare_with_axis(const std::int16_t *normals, const IntegerNormal &axis, std::int32_t least,
                       std::uint8_t *outside) {
    const hn::ScalableTag<std::int32_t> d;
    const hn::Rebind<std::int16_t, decltype(d)> stored;
    const hn::Rebind<std::int8_t, decltype(d)> bytes;
    const auto x = hn::Set(d, axis[0]), y = hn::Set(d, axis[1]), z = hn::Set(d, axis[2]), limit = hn::Set(d, least);
    for (std::size_t i = 0; i < kNormalCount; i += hn::Lanes(d)) {
        const auto part = [&](std::size_t c) {
            return hn::PromoteTo(d, hn::LoadU(stored, normals + c * kNormalCount + i));
        };
        const auto product = hn::Add(hn::Add(hn::Mul(part(0), x), hn::Mul(part(1), y)), hn::Mul(part(2), z));
        const auto verdict = hn::DemoteTo(bytes, hn::VecFromMask(d, hn::Lt(product, limit)));
        hn::StoreU(verdict, bytes, reinterpret_cast<std::int8_t *>(outside + i));
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(compare_with_axis);

namespace {

// The integer normals, all x, then all y, then all z.
struct Coordinates {
    std::array<std::int16_t, 3 * kNormalCount> of_normals{};

    Coordinates() {
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t i = 0; i < kNormalCount; ++i)
                of_normals[c * kNormalCount + i] = static_cast<std::int16_t>(integer_normal_table()[i][c]);
    }
};

std::int32_t least_product(const NormalCone &cone) { return cone.cosine * 32767; }

} // namespace

void mark_outside(const NormalCone &cone, OutsideCone &outside) {
    static const Coordinates coordinates;
    HWY_DYNAMIC_DISPATCH(compare_with_axis)
    (coordinates.of_normals.data(), integer_normal_table()[cone.axis], least_product(cone), outside.data());
    std::fill(outside.begin() + kTwoSidedBit, outside.end(), std::uint8_t{1}); // seen from anywhere
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
        return (normal & kTwoSidedBit) == 0 && axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2] >= least_product(cone);
    });
}

Value needed_cosine(const NormalCone &cone, std::span<const std::uint16_t> normals) {
    const std::span<const IntegerNormal> table = integer_normal_table();
    const IntegerNormal axis = table[cone.axis];
    std::int32_t least = 32767 * 32767;
    for (const std::uint16_t normal : normals) {
        if ((normal & kTwoSidedBit) != 0)
            return "no cone: a point is two-sided";
        const IntegerNormal &n = table[normal & kNormalIndexMask];
        least = std::min(least, axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2]);
    }
    return least >= 0 ? least / 32767 : (least - 32766) / 32767;
}

} // namespace pbm
#endif // HWY_ONCE
