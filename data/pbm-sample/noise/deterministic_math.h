// Arithmetic with the same last bit everywhere.
//
// The sample must have the same bytes for every compiler, C library and optimisation level. So this file does not call
// libm: it uses only IEEE 754 + - * / and sqrt, which are exactly rounded, in an order that the source fixes. Compile
// with -ffp-contract=off and never with -ffast-math. Angles are in turns (1 turn = 2 pi radians), which makes range
// reduction exact.
#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace pbm::sample {

constexpr double kTwoPi = 6.283185307179586476925286766559;

// Largest integer not above x. |x| < 2^62.
inline std::int64_t floor_to_int(double x) {
    const auto truncated = static_cast<std::int64_t>(x);
    return truncated - (static_cast<double>(truncated) > x ? 1 : 0);
}

// x - floor(x), in [0, 1].
inline double fraction(double x) { return x - static_cast<double>(floor_to_int(x)); }

// Sine of an angle in turns. Absolute error below 1e-9.
inline double sin_turns(double turns) {
    double t = turns - static_cast<double>(floor_to_int(turns + 0.5)); // [-1/2, 1/2)
    if (t > 0.25)
        t = 0.5 - t;
    else if (t < -0.25)
        t = -0.5 - t;
    const double x = t * kTwoPi; // [-pi/2, pi/2]
    const double x2 = x * x;
    const double tail = 1.0 / 362880.0 + x2 * (-1.0 / 39916800.0 + x2 * (1.0 / 6227020800.0));
    return x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * tail))));
}

inline double cos_turns(double turns) { return sin_turns(turns + 0.25); }

// e^x for |x| < 700. Relative error below 1e-10.
inline double exp_natural(double x) {
    constexpr double kLn2 = 0.693147180559945309417232121458;
    const std::int64_t power = floor_to_int(x / kLn2 + 0.5);
    const double r = x - static_cast<double>(power) * kLn2; // [-0.35, 0.35]
    const double tail = 1.0 / 720 + r * (1.0 / 5040 + r * (1.0 / 40320 + r * (1.0 / 362880)));
    const double sum = 1.0 + r * (1.0 + r * (1.0 / 2 + r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r * tail)))));
    return sum * std::bit_cast<double>(static_cast<std::uint64_t>(power + 1023) << 52);
}

// Direction of (x, y) in turns, in [-1/2, 1/2]; 0 for the zero vector. Absolute error below 1e-8.
inline double atan2_turns(double y, double x) {
    const double ax = std::abs(x), ay = std::abs(y);
    const double large = std::max(ax, ay);
    if (large == 0)
        return 0;
    // atan(q) = atan(1/2) + atan((q - 1/2) / (1 + q/2)) leaves |s| <= 1/2, where the series converges fast.
    const double q = std::min(ax, ay) / large;
    constexpr double kAtanHalf = 0.463647609000806116214256231461;
    const double s = (q - 0.5) / (1.0 + 0.5 * q);
    const double s2 = s * s;
    const double tail = 1.0 / 11 - s2 * (1.0 / 13 - s2 * (1.0 / 15 - s2 * (1.0 / 17 - s2 * (1.0 / 19 - s2 / 21))));
    const double series = 1.0 - s2 * (1.0 / 3 - s2 * (1.0 / 5 - s2 * (1.0 / 7 - s2 * (1.0 / 9 - s2 * tail))));
    double turns = (kAtanHalf + s * series) * (1.0 / kTwoPi);
    if (ay > ax)
        turns = 0.25 - turns;
    if (x < 0)
        turns = 0.5 - turns;
    return y < 0 ? -turns : turns;
}

inline double mix(double a, double b, double t) { return a + (b - a) * t; }

inline double clamp01(double x) { return std::min(std::max(x, 0.0), 1.0); }

// 0 below `low`, 1 above `high`, a smooth cubic in between.
inline double smooth_step(double low, double high, double x) {
    const double t = clamp01((x - low) / (high - low));
    return t * t * (3.0 - 2.0 * t);
}

// GLM's arithmetic of components alone: its functions may be compiled to instructions that round otherwise.
using Vec3 = glm::dvec3;

inline double dot(const Vec3 &a, const Vec3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(const Vec3 &a) { return std::sqrt(dot(a, a)); }

// Unit vector; +Z for the zero vector.
inline Vec3 normalized(const Vec3 &a) {
    const double l = length(a);
    return l > 0 ? a / l : Vec3(0, 0, 1);
}

} // namespace pbm::sample
