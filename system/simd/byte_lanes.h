// Vectors of 16 or 32 bytes with the best instructions of the target. For files that Highway compiles for several
// targets: include it after highway.h, once per target.
#if defined(PBM_FORMAT_BYTE_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PBM_FORMAT_BYTE_LANES_H
#undef PBM_FORMAT_BYTE_LANES_H
#else
#define PBM_FORMAT_BYTE_LANES_H
#endif

#include "system/simd/target_gaps.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

constexpr std::size_t kBlock = 16; // bytes within which one shuffle selects

#if HWY_TARGET == HWY_SCALAR

constexpr std::size_t kLanes = 16;

// 16 bytes, for targets without SIMD.
struct Lanes {
    std::uint8_t lane[kLanes];
};

template <class Operation> HWY_INLINE Lanes for_lanes(Operation &&operation) {
    Lanes result;
    for (std::size_t i = 0; i < kLanes; ++i)
        result.lane[i] = static_cast<std::uint8_t>(operation(i));
    return result;
}

HWY_INLINE Lanes set(std::uint8_t value) {
    return for_lanes([&](std::size_t) { return value; });
}
HWY_INLINE Lanes load(const std::uint8_t *from) {
    return for_lanes([&](std::size_t i) { return from[i]; });
}
HWY_INLINE void store(Lanes a, std::uint8_t *to) { std::memcpy(to, a.lane, kLanes); }
HWY_INLINE Lanes operator+(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] + b.lane[i]; });
}
HWY_INLINE Lanes operator-(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] - b.lane[i]; });
}
HWY_INLINE Lanes operator&(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] & b.lane[i]; });
}
HWY_INLINE Lanes operator|(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] | b.lane[i]; });
}
HWY_INLINE Lanes operator^(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] ^ b.lane[i]; });
}
template <int kBits> HWY_INLINE Lanes shift_left(Lanes a) {
    return for_lanes([&](std::size_t i) { return a.lane[i] << kBits; });
}
template <int kBits> HWY_INLINE Lanes shift_right(Lanes a) {
    return for_lanes([&](std::size_t i) { return a.lane[i] >> kBits; });
}
// Within a block, lane i becomes lane i + kBy.
template <int kBy> HWY_INLINE Lanes shift_lanes(Lanes a) {
    return for_lanes([&](std::size_t i) { return i < kBy ? 0 : a.lane[i - kBy]; });
}
// 255 in lanes that are equal, else 0.
HWY_INLINE Lanes equal_bytes(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return a.lane[i] == b.lane[i] ? 255 : 0; });
}
// A table of 16 bytes for each block.
HWY_INLINE Lanes load_tables(const std::uint8_t *const from[]) { return load(from[0]); }
// table[index] within each block; 0 if bit 7 of the index is set
HWY_INLINE Lanes lookup(Lanes table, Lanes index) {
    return for_lanes([&](std::size_t i) { return index.lane[i] > 127 ? 0 : table.lane[index.lane[i] & 15]; });
}
// Bit i is set if lanes i are equal.
HWY_INLINE unsigned equal_lanes(Lanes a, Lanes b) {
    unsigned bits = 0;
    for (unsigned i = 0; i < kLanes; ++i)
        bits |= (a.lane[i] == b.lane[i] ? 1U : 0U) << i;
    return bits;
}
HWY_INLINE Lanes largest(Lanes a, Lanes b) {
    return for_lanes([&](std::size_t i) { return std::max(a.lane[i], b.lane[i]); });
}
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b) {
    a = for_lanes([&](std::size_t i) { return from[2 * i]; });
    b = for_lanes([&](std::size_t i) { return from[2 * i + 1]; });
}
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b, Lanes &c) {
    a = for_lanes([&](std::size_t i) { return from[3 * i]; });
    b = for_lanes([&](std::size_t i) { return from[3 * i + 1]; });
    c = for_lanes([&](std::size_t i) { return from[3 * i + 2]; });
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, std::uint8_t *to) {
    for (std::size_t i = 0; i < kLanes; ++i) {
        to[2 * i] = a.lane[i];
        to[2 * i + 1] = b.lane[i];
    }
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, Lanes c, std::uint8_t *to) {
    for (std::size_t i = 0; i < kLanes; ++i) {
        to[3 * i] = a.lane[i];
        to[3 * i + 1] = b.lane[i];
        to[3 * i + 2] = c.lane[i];
    }
}

#else

namespace hn = hwy::HWY_NAMESPACE;

// Two blocks if the target has vectors of 32 bytes, else one.
#if HWY_MAX_BYTES >= 32
constexpr std::size_t kLanes = 32;
#else
constexpr std::size_t kLanes = 16;
#endif
using Tag = hn::FixedTag<std::uint8_t, kLanes>;
// A wrapper class, so that operators exist on every target.
struct Lanes {
    hn::Vec<Tag> v;
};

HWY_INLINE Lanes set(std::uint8_t value) { return {hn::Set(Tag(), value)}; }
HWY_INLINE Lanes load(const std::uint8_t *from) { return {hn::LoadU(Tag(), from)}; }
HWY_INLINE void store(Lanes a, std::uint8_t *to) { hn::StoreU(a.v, Tag(), to); }
HWY_INLINE Lanes operator+(Lanes a, Lanes b) { return {hn::Add(a.v, b.v)}; }
HWY_INLINE Lanes operator-(Lanes a, Lanes b) { return {hn::Sub(a.v, b.v)}; }
HWY_INLINE Lanes operator&(Lanes a, Lanes b) { return {hn::And(a.v, b.v)}; }
HWY_INLINE Lanes operator|(Lanes a, Lanes b) { return {hn::Or(a.v, b.v)}; }
HWY_INLINE Lanes operator^(Lanes a, Lanes b) { return {hn::Xor(a.v, b.v)}; }
template <int kBits> HWY_INLINE Lanes shift_left(Lanes a) { return {hn::ShiftLeft<kBits>(a.v)}; }
template <int kBits> HWY_INLINE Lanes shift_right(Lanes a) { return {hn::ShiftRight<kBits>(a.v)}; }
template <int kBy> HWY_INLINE Lanes shift_lanes(Lanes a) { return {hn::ShiftLeftBytes<kBy>(Tag(), a.v)}; }
HWY_INLINE Lanes equal_bytes(Lanes a, Lanes b) { return {hn::VecFromMask(Tag(), hn::Eq(a.v, b.v))}; }
HWY_INLINE Lanes load_tables(const std::uint8_t *const from[]) {
#if HWY_MAX_BYTES >= 32
    const hn::Half<Tag> half;
    return {hn::Combine(Tag(), hn::LoadU(half, from[1]), hn::LoadU(half, from[0]))};
#else
    return load(from[0]);
#endif
}
HWY_INLINE Lanes lookup(Lanes table, Lanes index) { return {lookup_bytes(table.v, index.v)}; }
HWY_INLINE unsigned equal_lanes(Lanes a, Lanes b) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(Tag(), hn::Eq(a.v, b.v), bits);
    std::uint32_t all;
    std::memcpy(&all, bits, sizeof all);
    return all;
}
HWY_INLINE Lanes largest(Lanes a, Lanes b) { return {hn::Max(a.v, b.v)}; }
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b) {
    hn::LoadInterleaved2(Tag(), from, a.v, b.v);
}
HWY_INLINE void load_interleaved(const std::uint8_t *from, Lanes &a, Lanes &b, Lanes &c) {
    hn::LoadInterleaved3(Tag(), from, a.v, b.v, c.v);
}
HWY_INLINE void store_interleaved(Lanes a, Lanes b, std::uint8_t *to) { hn::StoreInterleaved2(a.v, b.v, Tag(), to); }
HWY_INLINE void store_interleaved(Lanes a, Lanes b, Lanes c, std::uint8_t *to) {
    hn::StoreInterleaved3(a.v, b.v, c.v, Tag(), to);
}

#endif

HWY_INLINE unsigned count_lanes(unsigned bits) { return static_cast<unsigned>(std::popcount(bits)); }

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
