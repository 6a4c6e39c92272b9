// A unit vector in three 16-bit integers: the normal of a sample, and the unit in which normals are summed.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <cstdint>

namespace pbm::build {

// Unit vector x 32,767, rounded; {0, 0, 0}: no normal here.
using ShortNormal = std::array<std::int16_t, 3>;
inline constexpr double kNormalScale = 32767;

// `v` may have any finite length that survives squaring.
inline ShortNormal to_short_normal(const glm::dvec3 &v) {
    const double length = std::sqrt((v.x * v.x + v.y * v.y) + v.z * v.z);
    if (!(length > 0))
        return {};
    const double scale = kNormalScale / length;
    const auto round = [&](double x) { return static_cast<std::int16_t>(x * scale + std::copysign(0.5, x)); };
    return {round(v.x), round(v.y), round(v.z)};
}

// Normals of many samples in columns, so that their square roots and divisions run as vector instructions.
struct NormalColumns {
    static constexpr std::size_t kRows = 64, kSpare = 8; // vectors may end in spare rows
    using Column = std::array<double, kRows + kSpare>;

    std::array<Column, 3> from{};                                      // any length, or a ShortNormal
    Column is_rounded{};                                               // 1, else 0
    std::array<std::array<std::int32_t, kRows + kSpare>, 3> rounded{}; // the ShortNormal of each row
    void round(std::size_t rows = kRows);                              // fills `rounded` for the first `rows`
};

inline bool is_zero(const ShortNormal &n) { return (n[0] | n[1] | n[2]) == 0; }

// 32,767^2 x the cosine of the angle between the two.
inline std::int64_t dot(const ShortNormal &a, const ShortNormal &b) {
    return std::int64_t{a[0]} * b[0] + std::int64_t{a[1]} * b[1] + std::int64_t{a[2]} * b[2];
}

} // namespace pbm::build
