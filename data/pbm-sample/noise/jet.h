// Numbers with their exact derivatives, four points at a time: forward-mode automatic differentiation.
//
// A lane is plain IEEE 754 single precision in the order that the source fixes, so the last bit is the same everywhere
// (deterministic_math.h). Nothing here calls libm.
#pragma once

#include <cmath>
#include <cstdint>

namespace pbm::sample {

// A vector extension of both GCC and Clang.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Uint4 = std::uint32_t __attribute__((vector_size(16)));

inline constexpr int kLanes = 4;

inline Float4 all(float value) { return Float4{value, value, value, value}; }
inline Float4 to_float(Int4 a) { return __builtin_convertvector(a, Float4); }
inline Int4 truncated(Float4 a) { return __builtin_convertvector(a, Int4); } // |a| < 2^31

// Per lane: `mask` is all ones or all zeros.
inline Float4 choose(Int4 mask, Float4 yes, Float4 no) { return (Float4)((mask & (Int4)yes) | (~mask & (Int4)no)); }
inline bool any(Int4 mask) {
    using Long2 = std::int64_t __attribute__((vector_size(16)));
    const auto halves = (Long2)mask;
    return (halves[0] | halves[1]) != 0;
}
inline Float4 smaller(Float4 a, Float4 b) { return choose((Int4)(a < b), a, b); }
inline Float4 larger(Float4 a, Float4 b) { return choose((Int4)(a > b), a, b); }
inline Float4 clamp01(Float4 a) { return smaller(larger(a, all(0)), all(1)); }
inline Float4 mix(Float4 a, Float4 b, Float4 t) { return a + (b - a) * t; }

inline Float4 square_root(Float4 a) {
    return Float4{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}

// Largest integer not above a. |a| < 2^31.
inline Int4 floor_to_int(Float4 a) {
    const Int4 i = truncated(a);
    return i + (Int4)(to_float(i) > a);
}

// 0 below `low`, 1 above `high`, a smooth cubic in between.
inline Float4 smooth_step(float low, float high, Float4 a) {
    const Float4 t = clamp01((a - low) * (1.0f / (high - low)));
    return t * t * (3.0f - 2.0f * t);
}

// Sine and cosine of an angle in turns, |turns| < 2^22. Absolute error below 3e-7.
inline void sin_cos_turns(Float4 turns, Float4 &sine, Float4 &cosine) {
    const Float4 t = turns - to_float(floor_to_int(turns + 0.5f)); // [-1/2, 1/2]
    const auto folded_sine = [](Float4 a) {                        // a in [-3/4, 3/4]
        a = choose((Int4)(a > 0.5f), a - 1.0f, a);
        a = choose((Int4)(a > 0.25f), 0.5f - a, choose((Int4)(a < -0.25f), -0.5f - a, a));
        const Float4 x = a * 6.28318530717958647692f; // [-pi/2, pi/2]
        const Float4 x2 = x * x;
        const Float4 tail = 1.0f / 362880.0f - x2 * (1.0f / 39916800.0f);
        return x * (1.0f + x2 * (-1.0f / 6.0f + x2 * (1.0f / 120.0f + x2 * (-1.0f / 5040.0f + x2 * tail))));
    };
    sine = folded_sine(t);
    cosine = folded_sine(t + 0.25f);
}

// A function's values at four points, and its partial derivatives by D coordinates.
template <int D> struct Jet {
    Float4 value;
    Float4 slope[D];
};

using Jet2 = Jet<2>;
using Jet3 = Jet<3>;

template <int D> Jet<D> constant(Float4 value) {
    Jet<D> out{value, {}};
    return out;
}

// The coordinate number `axis` itself.
template <int D> Jet<D> coordinate(Float4 value, int axis) {
    Jet<D> out{value, {}};
    out.slope[axis] = all(1);
    return out;
}

// f(a): its value, and its derivative by a.
template <int D> Jet<D> chain(const Jet<D> &a, Float4 value, Float4 derivative) {
    Jet<D> out{value, {}};
    for (int i = 0; i < D; ++i)
        out.slope[i] = derivative * a.slope[i];
    return out;
}

template <int D> Jet<D> operator+(const Jet<D> &a, const Jet<D> &b) {
    Jet<D> out{a.value + b.value, {}};
    for (int i = 0; i < D; ++i)
        out.slope[i] = a.slope[i] + b.slope[i];
    return out;
}
template <int D> Jet<D> operator-(const Jet<D> &a, const Jet<D> &b) {
    Jet<D> out{a.value - b.value, {}};
    for (int i = 0; i < D; ++i)
        out.slope[i] = a.slope[i] - b.slope[i];
    return out;
}
template <int D> Jet<D> operator*(const Jet<D> &a, const Jet<D> &b) {
    Jet<D> out{a.value * b.value, {}};
    for (int i = 0; i < D; ++i)
        out.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    return out;
}
template <int D> Jet<D> operator*(const Jet<D> &a, float b) { return chain(a, a.value * b, all(b)); }
template <int D> Jet<D> operator+(const Jet<D> &a, float b) { return chain(a, a.value + b, all(1)); }
template <int D> Jet<D> operator-(float a, const Jet<D> &b) { return chain(b, a - b.value, all(-1)); }

template <int D> Jet<D> square(const Jet<D> &a) { return chain(a, a.value * a.value, 2.0f * a.value); }

// a.value > 0
template <int D> Jet<D> square_root(const Jet<D> &a) {
    const Float4 root = square_root(a.value);
    return chain(a, root, 0.5f / root);
}

// a.value != 0
template <int D> Jet<D> inverse(const Jet<D> &a) {
    const Float4 value = 1.0f / a.value;
    return chain(a, value, -value * value);
}

// |a| with a rounded corner: sqrt(a^2 + rounding^2).
template <int D> Jet<D> rounded_abs(const Jet<D> &a, float rounding) {
    return square_root(square(a) + rounding * rounding);
}

template <int D> Jet<D> mix(const Jet<D> &a, const Jet<D> &b, const Jet<D> &t) { return a + (b - a) * t; }

// 0 below `low`, 1 above `high`, a smooth cubic in between.
template <int D> Jet<D> smooth_step(float low, float high, const Jet<D> &a) {
    const float scale = 1.0f / (high - low);
    const Float4 t = clamp01((a.value - low) * scale);
    return chain(a, t * t * (3.0f - 2.0f * t), 6.0f * scale * t * (1.0f - t));
}

} // namespace pbm::sample
