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

// [4 bits]: their bytes, for vectors of four lanes.
alignas(16) inline constexpr std::array<std::array<std::uint8_t, 16>, 16> kPackedBytes = [] {
    std::array<std::array<std::uint8_t, 16>, 16> bytes{};
    for (std::size_t bits = 0; bits < bytes.size(); ++bits)
        for (std::size_t i = 0; i < 16; ++i)
            bytes[bits][i] =
                static_cast<std::uint8_t>(4 * kPackedLanes[bits][i / 4] + static_cast<std::int32_t>(i % 4));
    return bytes;
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

// A bit for each lane.
HWY_INLINE unsigned mask_bits(Mask mask) {
    std::array<std::uint8_t, 8> bits{};
    const std::size_t bytes = hwy::HWY_NAMESPACE::StoreMaskBits(Floats(), mask, bits.data());
    return unsigned{bits[0]} | (bytes > 1 ? unsigned{bits[1]} << 8 : 0U);
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
    HWY_INLINE Vector operator()(Vector v) const { return look_up(v, from_); }
    HWY_INLINE IntVector operator()(IntVector v) const {
        namespace hn = hwy::HWY_NAMESPACE;
        return hn::BitCast(Ints(), look_up(hn::BitCast(Floats(), v), from_));
    }

  private:
#if HWY_MAX_BYTES == 16
    using Bytes = hwy::HWY_NAMESPACE::Repartition<std::uint8_t, Floats>;
    using Indices = hwy::HWY_NAMESPACE::Vec<Bytes>;
    static HWY_INLINE Indices indices_of(std::size_t bits) {
        return hwy::HWY_NAMESPACE::Load(Bytes(), kPackedBytes[bits].data());
    }
    static HWY_INLINE Vector look_up(Vector v, Indices from) {
        namespace hn = hwy::HWY_NAMESPACE;
        return hn::BitCast(Floats(), hn::TableLookupBytes(hn::BitCast(Bytes(), v), from));
    }
#else
    using Indices = decltype(hwy::HWY_NAMESPACE::IndicesFromVec(Floats(), hwy::HWY_NAMESPACE::Zero(Ints())));
    static HWY_INLINE Indices indices_of(std::size_t bits) {
        namespace hn = hwy::HWY_NAMESPACE;
        return hn::IndicesFromVec(Floats(), hn::LoadU(Ints(), kPackedLanes[bits].data()));
    }
    static HWY_INLINE Vector look_up(Vector v, Indices from) { return hwy::HWY_NAMESPACE::TableLookupLanes(v, from); }
#endif
    static HWY_INLINE Indices indices(Mask keep) { return indices_of(mask_bits(keep)); }

    Indices from_;
};
#endif

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
