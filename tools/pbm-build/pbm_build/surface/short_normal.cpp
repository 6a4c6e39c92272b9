#include "pbm_build/surface/short_normal.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/surface/short_normal.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The operations of to_short_normal in the same order, on several rows at once.
void round_columns(NormalColumns &columns, std::size_t rows) {
    const hn::CappedTag<double, NormalColumns::kSpare> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    const auto zero = hn::Zero(d), half = hn::Set(d, 0.5);
    for (std::size_t row = 0; row < rows; row += hn::Lanes(d)) {
        const auto x = hn::LoadU(d, &columns.from[0][row]), y = hn::LoadU(d, &columns.from[1][row]),
                   z = hn::LoadU(d, &columns.from[2][row]);
        const auto length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
        const auto divided = hn::IfThenElseZero(hn::Gt(length, zero), hn::Div(hn::Set(d, kNormalScale), length));
        const auto is_rounded = hn::Gt(hn::LoadU(d, &columns.is_rounded[row]), zero);
        const auto scale = hn::IfThenElse(is_rounded, hn::Set(d, 1), divided);
        const auto round = [&](auto v, std::size_t axis) {
            hn::StoreU(hn::DemoteTo(di, hn::Add(hn::Mul(v, scale), hn::CopySign(half, v))), di,
                       &columns.rounded[axis][row]);
        };
        round(x, 0);
        round(y, 1);
        round(z, 2);
    }
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(round_columns);

void NormalColumns::round(std::size_t rows) { HWY_DYNAMIC_DISPATCH(round_columns)(*this, rows); }

} // namespace pbm::build
#endif // HWY_ONCE
