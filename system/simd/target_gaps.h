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
