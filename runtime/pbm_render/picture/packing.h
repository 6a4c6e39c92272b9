// SIMD vector types, lane numbers, and packing of selected lanes to the front. For files that Highway compiles for
// several targets: include it after highway.h, once per target.
#if defined(PBM_RENDER_PACKING_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_RENDER_PACKING_H
#undef PBM_RENDER_PACKING_H
#else
#define PBM_RENDER_PACKING_H
#endif

#include <array>
#include <cstdint>

#ifndef PBM_RENDER_PACKING_TABLE
#define PBM_RENDER_PACKING_TABLE
namespace pbm {

// [byte]: the lanes whose bits are set, in order.
inline constexpr std::array<std::array<std::int32_t, 8>, 256> kPackedLanes = [] {
    std::array<std::array<std::int32_t, 8>, 256> lanes{};
    for (std::size_t bits = 0; bits < 256; ++bits) {
        std::size_t n = 0;
        for (std::int32_t lane = 0; lane < 8; ++lane)
            if ((bits >> lane & 1) != 0)
                lanes[bits][n++] = lane;
    }
    return lanes;
}();

inline constexpr std::array<std::int32_t, 16> kLaneNumbers{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

} // namespace pbm
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// Vectors of at most 16 four-byte lanes.
using Floats = hwy::HWY_NAMESPACE::CappedTag<float, 16>;
using Ints = hwy::HWY_NAMESPACE::RebindToSigned<Floats>;
using Vector = hwy::HWY_NAMESPACE::Vec<Floats>;
using IntVector = hwy::HWY_NAMESPACE::Vec<Ints>;
using Mask = hwy::HWY_NAMESPACE::Mask<Floats>;

// first, first + 1, ...: Highway 1.0's Iota fills the lanes one by one through memory.
HWY_INLINE IntVector count_from(std::int32_t first) {
    namespace hn = hwy::HWY_NAMESPACE;
    return hn::Add(hn::Set(Ints(), first), hn::LoadU(Ints(), kLaneNumbers.data()));
}

#if HWY_TARGET <= HWY_AVX3 || HWY_TARGET == HWY_SCALAR
class Packing {
  public:
    explicit HWY_INLINE Packing(Mask keep) : keep_(keep) {}
    HWY_INLINE Vector operator()(Vector v) const { return hwy::HWY_NAMESPACE::Compress(v, keep_); }
    HWY_INLINE IntVector operator()(IntVector v) const {
        return hwy::HWY_NAMESPACE::Compress(v, hwy::HWY_NAMESPACE::RebindMask(Ints(), keep_));
    }

  private:
    Mask keep_;
};
#else // Compress of Highway 1.0 copies its table at every call
class Packing {
  public:
    explicit HWY_INLINE Packing(Mask keep) : from_(indices(keep)) {}
    HWY_INLINE Vector operator()(Vector v) const { return hwy::HWY_NAMESPACE::TableLookupLanes(v, from_); }
    HWY_INLINE IntVector operator()(IntVector v) const {
        namespace hn = hwy::HWY_NAMESPACE;
        return hn::BitCast(Ints(), hn::TableLookupLanes(hn::BitCast(Floats(), v), from_));
    }

  private:
    using Indices = decltype(hwy::HWY_NAMESPACE::IndicesFromVec(Floats(), hwy::HWY_NAMESPACE::Zero(Ints())));
    static HWY_INLINE Indices indices(Mask keep) {
        namespace hn = hwy::HWY_NAMESPACE;
        std::array<std::uint8_t, 8> bits{};
        hn::StoreMaskBits(Floats(), keep, bits.data());
        return hn::IndicesFromVec(Floats(), hn::LoadU(Ints(), kPackedLanes[bits[0]].data()));
    }

    Indices from_;
};
#endif

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
