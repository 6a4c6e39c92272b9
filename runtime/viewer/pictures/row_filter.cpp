#include "viewer/pictures/row_filter.h"

#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/pictures/row_filter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "system/simd/target_gaps.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

void filter_row(const std::uint8_t *row, const std::uint8_t *above, std::size_t columns, std::uint8_t *to) {
    std::size_t x = 0;
#if HWY_TARGET != HWY_SCALAR
    namespace hn = hwy::HWY_NAMESPACE;
    alignas(16) static constexpr std::uint8_t kColours[16] = {0,  1,  2,  4,  5,   6,   8,   9,
                                                              10, 12, 13, 14, 128, 128, 128, 128};
    const hn::FixedTag<std::uint8_t, 16> d;
    const auto colours = hn::Load(d, kColours);
    for (; x + 6 <= columns; x += 4) { // the four bytes behind belong to the next two pixels
        const auto difference = hn::Sub(hn::LoadU(d, row + 4 * x), hn::LoadU(d, above + 4 * x));
        hn::StoreU(lookup_bytes(difference, colours), d, to + 3 * x);
    }
#endif
    for (; x < columns; ++x) { // four bytes at once: the next pixel overwrites the fourth
        std::uint8_t difference[4];
        for (std::size_t c = 0; c < 4; ++c)
            difference[c] = static_cast<std::uint8_t>(row[4 * x + c] - above[4 * x + c]);
        std::memcpy(to + 3 * x, difference, 4);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(filter_row);

void filter_opaque_row(const std::uint8_t *row, const std::uint8_t *above, std::size_t columns, std::uint8_t *to) {
    HWY_DYNAMIC_DISPATCH(filter_row)(row, above, columns, to);
}

} // namespace pbm
#endif // HWY_ONCE
