#include "pbm_render/fast/strip_pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/fast/strip_pixels.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/packing.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void write_row(const DepthStrip &strip, int y, std::uint32_t background, const PixelRow &to, CoveredPixels &covered) {
    const auto [colours, depths, width, scale] = to; // copies: the stores below cannot alias them
    const Floats d;
    const Ints di;
    const hn::RebindToUnsigned<Floats> du;
    const std::size_t lanes = hn::Lanes(d);
    const auto *const pixels = reinterpret_cast<const float *>(strip.pixels.data() + strip.offset(0, y));
    const Vector infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    covered.count = 0;
    for (std::size_t x = 0; x < width; x += lanes) {
        Vector id, depth;
        hn::LoadInterleaved2(d, pixels + 2 * x, id, depth); // rows are padded for whole vectors
        const std::size_t left = width - x;
        if (left >= lanes)
            hn::StoreU(hn::Set(du, background), du, colours + x);
        else
            hn::BlendedStore(hn::Set(du, background), hn::FirstN(du, left), du, colours + x);
        if (depths != nullptr) {
            const Vector scaled = hn::Mul(depth, hn::Set(d, scale));
            if (left >= lanes)
                hn::StoreU(scaled, d, depths + x);
            else
                hn::BlendedStore(scaled, hn::FirstN(d, left), d, depths + x);
        }
        const auto drawn = hn::And(hn::Lt(depth, infinity), hn::FirstN(d, left));
        if (hn::AllFalse(d, drawn))
            continue;
        const Packing pack(drawn);
        hn::StoreU(pack(hn::BitCast(di, id)), di, covered.id.data() + covered.count);
        hn::StoreU(pack(count_from(static_cast<std::int32_t>(x))), di, covered.x.data() + covered.count);
        hn::StoreU(pack(depth), d, covered.depth.data() + covered.count);
        covered.count += hn::CountTrue(d, drawn);
    }
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {

HWY_EXPORT(write_row);

// Padded: the last store of a row writes a whole SIMD vector.
CoveredPixels::CoveredPixels(int width)
    : x(static_cast<std::size_t>(width) + kLaneNumbers.size()), id(x.size()), depth(x.size()) {}

void write_row(const DepthStrip &strip, int y, std::uint32_t background, const PixelRow &to, CoveredPixels &covered) {
    HWY_DYNAMIC_DISPATCH(write_row)(strip, y, background, to, covered);
}

} // namespace pbm
#endif // HWY_ONCE
