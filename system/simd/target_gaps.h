// Operations that Highway 1.0.3 lacks or makes slow on some target, each with that one special case: for files that
// Highway compiles for several targets; include it after highway.h, and not only once.
#if defined(PBM_TARGET_GAPS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_TARGET_GAPS_H
#undef PBM_TARGET_GAPS_H
#else
#define PBM_TARGET_GAPS_H
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

// The lesser of each two doubles, none of which is a NaN. On WebAssembly Highway has doubles, but not this.
template <class V> HWY_INLINE V lesser_doubles(V a, V b) {
#if HWY_TARGET == HWY_WASM
    return V{wasm_f64x2_pmin(a.raw, b.raw)};
#else
    return hwy::HWY_NAMESPACE::Min(a, b);
#endif
}

#if HWY_TARGET != HWY_SCALAR
// table[index] within each block of 16 bytes; 0 where an index has bit 7 set, anything for indices 16 to 127. On
// WebAssembly Highway's is a loop over bytes.
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
