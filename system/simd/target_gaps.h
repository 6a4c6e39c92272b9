// Operations that Highway 1.0.3 lacks or implements slowly on one target. For files that Highway compiles for several
// targets: include it after highway.h, once per target.
#if defined(PBM_TARGET_GAPS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_TARGET_GAPS_H
#undef PBM_TARGET_GAPS_H
#else
#define PBM_TARGET_GAPS_H
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// The lesser double in each lane; no NaN allowed. Highway lacks this for doubles on WebAssembly.
template <class V> HWY_INLINE V lesser_doubles(V a, V b) {
#if HWY_TARGET == HWY_WASM
    return V{wasm_f64x2_pmin(a.raw, b.raw)};
#else
    return hwy::HWY_NAMESPACE::Min(a, b);
#endif
}

// The largest byte. Highway lacks this for bytes on WebAssembly.
template <class D> HWY_INLINE std::uint8_t largest_byte([[maybe_unused]] D d, hwy::HWY_NAMESPACE::VFromD<D> v) {
#if HWY_TARGET == HWY_WASM
    const auto fold = [&](auto shuffled) { v = hwy::HWY_NAMESPACE::Max(v, shuffled); };
    fold(decltype(v){wasm_i64x2_shuffle(v.raw, v.raw, 1, 0)});
    fold(decltype(v){wasm_i32x4_shuffle(v.raw, v.raw, 1, 0, 3, 2)});
    fold(decltype(v){wasm_i16x8_shuffle(v.raw, v.raw, 1, 0, 3, 2, 5, 4, 7, 6)});
    fold(decltype(v){wasm_u16x8_shr(v.raw, 8)});
    return hwy::HWY_NAMESPACE::GetLane(v);
#else
    return hwy::HWY_NAMESPACE::GetLane(hwy::HWY_NAMESPACE::MaxOfLanes(d, v));
#endif
}

#if HWY_TARGET != HWY_SCALAR
// table[index] within each block of 16 bytes; 0 if bit 7 of the index is set, undefined for indices 16 to 127. On
// WebAssembly Highway's version is a loop over bytes.
template <class V> HWY_INLINE V lookup_bytes(V table, V indices) {
#if HWY_TARGET == HWY_WASM
    return V{wasm_i8x16_swizzle(table.raw, indices.raw)};
#else
    return hwy::HWY_NAMESPACE::TableLookupBytesOr0(table, indices);
#endif
}
#endif

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif // PBM_TARGET_GAPS_H
