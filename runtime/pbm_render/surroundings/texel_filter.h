// Bilinear look-ups of ready texels: for files that Highway compiles for several targets; include it after highway.h,
// and not only once. No multiplication is fused with an addition, so all targets give the same numbers.
#if defined(PBM_RENDER_TEXEL_FILTER_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_TEXEL_FILTER_H
#undef PBM_RENDER_TEXEL_FILTER_H
#else
#define PBM_RENDER_TEXEL_FILTER_H
#endif

#include "pbm_format/rasters/image_section.h"
#include "pbm_render/picture/packing.h"
#include "pbm_render/surroundings/texel_levels.h"

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

struct Colours {
    Vector red, green, blue; // linear
};

HWY_INLINE Colours mix(const Colours &a, const Colours &b, Vector t) {
    namespace hn = hwy::HWY_NAMESPACE;
    const auto between = [&](Vector from, Vector to) { return hn::Add(from, hn::Mul(t, hn::Sub(to, from))); };
    return {between(a.red, b.red), between(a.green, b.green), between(a.blue, b.blue)};
}

// 0, 1, 2, ..
HWY_INLINE Vector lane_numbers() {
    namespace hn = hwy::HWY_NAMESPACE;
    return hn::ConvertTo(Floats(), hn::LoadU(Ints(), kLaneNumbers.data()));
}

// The four texels around a place, and where between them it lies.
class Corners {
  public:
    // Four texels of 0.
    HWY_INLINE Corners() {
        namespace hn = hwy::HWY_NAMESPACE;
        const IntVector zero = hn::Zero(Ints());
        texels_ = {zero, zero, zero, zero};
        across_ = down_ = hn::Zero(Floats());
    }
    // `u`, `v` in picture widths and heights. Columns wrap where `wraps`, else they are clamped as rows always are.
    HWY_INLINE Corners(const TexelLevel &level, Vector u, Vector v, bool wraps) {
        namespace hn = hwy::HWY_NAMESPACE;
        const Floats d;
        const Ints di;
        const Vector half = hn::Set(d, 0.5F), zero = hn::Zero(d);
        const auto last_x = level.width() - 1, last_y = level.height() - 1;
        Vector x = hn::Sub(hn::Mul(u, hn::Set(d, static_cast<float>(level.width()))), half);
        Vector y = hn::Sub(hn::Mul(v, hn::Set(d, static_cast<float>(level.height()))), half);
        y = hn::Min(hn::Max(y, zero), hn::Set(d, static_cast<float>(last_y)));
        if (!wraps)
            x = hn::Min(hn::Max(x, zero), hn::Set(d, static_cast<float>(last_x)));
        const Vector left = hn::Floor(x), top = hn::Floor(y);
        across_ = hn::Sub(x, left);
        down_ = hn::Sub(y, top);
        const IntVector one = hn::Set(di, 1), mask = hn::Set(di, last_x);
        const IntVector x0 = hn::ConvertTo(di, left), x1 = hn::Add(x0, one);
        const IntVector y0 = hn::ConvertTo(di, top), y1 = hn::Min(hn::Add(y0, one), hn::Set(di, last_y));
        const IntVector upper = hn::ShiftLeftSame(y0, level.width_bits),
                        lower = hn::ShiftLeftSame(y1, level.width_bits);
        const auto *const texels = reinterpret_cast<const std::int32_t *>(level.texels);
        // Places next to each other mostly lie in one row of few texels: loading these and permuting them is faster
        // than gathering. The texels are of one tile, so that all of them are ready.
        constexpr int kTileMask = static_cast<int>(kTileEdge) - 1;
        const auto lanes = static_cast<std::int32_t>(hn::Lanes(d));
        const std::int32_t some_x = std::min(hn::GetLane(x0), hn::GetLane(hn::Reverse(di, x0)));
        const std::int32_t first = std::min(some_x, std::min(some_x | kTileMask, last_x) - (lanes - 1));
        const IntVector column = hn::Sub(x0, hn::Set(di, first)), row = hn::Set(di, hn::GetLane(y0));
        const IntVector beyond = hn::And(hn::Or(column, hn::Add(column, one)), hn::Set(di, -lanes));
        if (first >= 0 && hn::AllTrue(di, hn::Eq(hn::Or(beyond, hn::Xor(y0, row)), hn::Zero(di)))) {
            const Vector above = load(texels + hn::GetLane(upper) + first),
                         below = load(texels + hn::GetLane(lower) + first);
            const auto at = hn::IndicesFromVec(d, column), next = hn::IndicesFromVec(d, hn::Add(column, one));
            const auto pick = [&](Vector from, const auto &places) {
                return hn::BitCast(di, hn::TableLookupLanes(from, places));
            };
            texels_ = {pick(above, at), pick(above, next), pick(below, at), pick(below, next)};
            return;
        }
        const IntVector left_column = wraps ? hn::And(x0, mask) : x0;
        const IntVector right_column = wraps ? hn::And(x1, mask) : hn::Min(x1, mask);
        texels_ = {hn::GatherIndex(di, texels, hn::Add(upper, left_column)),
                   hn::GatherIndex(di, texels, hn::Add(upper, right_column)),
                   hn::GatherIndex(di, texels, hn::Add(lower, left_column)),
                   hn::GatherIndex(di, texels, hn::Add(lower, right_column))};
    }

    HWY_INLINE Colours colours() const {
        namespace hn = hwy::HWY_NAMESPACE;
        const Vector scale = hn::Set(Floats(), 1 / (kRootSteps * kRootSteps));
        return {hn::Mul(scale, blend<0, 1023, true>()), hn::Mul(scale, blend<10, 1023, true>()),
                hn::Mul(scale, blend<20, 1023, true>())};
    }
    // Of byte `kByte`, 0..255.
    template <int kByte> HWY_INLINE Vector values() const { return blend<8 * kByte, 255, false>(); }

  private:
    static HWY_INLINE Vector load(const std::int32_t *words) {
        namespace hn = hwy::HWY_NAMESPACE;
        return hn::BitCast(Floats(), hn::LoadU(Ints(), words));
    }
    template <int kShift, int kMask, bool kSquare> HWY_INLINE Vector unpacked(IntVector texel) const {
        namespace hn = hwy::HWY_NAMESPACE;
        const IntVector bits = hn::And(hn::ShiftRight<kShift>(texel), hn::Set(Ints(), kMask));
        const Vector value = hn::ConvertTo(Floats(), bits);
        return kSquare ? hn::Mul(value, value) : value;
    }
    template <int kShift, int kMask, bool kSquare> HWY_INLINE Vector blend() const {
        namespace hn = hwy::HWY_NAMESPACE;
        const Vector a = unpacked<kShift, kMask, kSquare>(texels_.upper_left);
        const Vector b = unpacked<kShift, kMask, kSquare>(texels_.upper_right);
        const Vector c = unpacked<kShift, kMask, kSquare>(texels_.lower_left);
        const Vector e = unpacked<kShift, kMask, kSquare>(texels_.lower_right);
        const Vector upper = hn::Add(a, hn::Mul(across_, hn::Sub(b, a)));
        const Vector lower = hn::Add(c, hn::Mul(across_, hn::Sub(e, c)));
        return hn::Add(upper, hn::Mul(down_, hn::Sub(lower, upper)));
    }

    struct Texels {
        IntVector upper_left, upper_right, lower_left, lower_right;
    };
    Texels texels_;
    Vector across_, down_;
};

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
