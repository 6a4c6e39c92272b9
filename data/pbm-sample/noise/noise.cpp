#include "noise.h"

#include "jet.h"

namespace pbm::sample {

namespace {

float fade(float t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }

double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

// Dot products of gradients with offsets from their lattice points. Components of gradients are up to 2^10 and come
// from mixing the bits of `h`.
Float4 slopes(Uint4 h, Float4 x, Float4 y, Float4 z) {
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    h ^= h >> 15;
    const Float4 gx = __builtin_convertvector((Int4)(h & 0x7ffu) - 0x400, Float4);
    const Float4 gy = __builtin_convertvector((Int4)(h >> 11 & 0x7ffu) - 0x400, Float4);
    const Float4 gz = __builtin_convertvector((Int4)(h >> 21) - 0x400, Float4);
    return gx * x + gy * y + gz * z;
}

} // namespace

double gradient_noise(const Vec3 &p, std::uint32_t seed) {
    const std::int64_t ix = floor_to_int(p.x);
    const std::int64_t iy = floor_to_int(p.y);
    const std::int64_t iz = floor_to_int(p.z);
    const auto x = static_cast<float>(p.x - static_cast<double>(ix));
    const auto y = static_cast<float>(p.y - static_cast<double>(iy));
    const auto z = static_cast<float>(p.z - static_cast<double>(iz));

    constexpr std::uint32_t kX = 0x8da6b343u;
    constexpr std::uint32_t kY = 0xd8163841u;
    constexpr std::uint32_t kZ = 0xcb1ab31fu;
    const std::uint32_t x0 = static_cast<std::uint32_t>(ix) * kX + seed * 0x9e3779b1u;
    const std::uint32_t y0 = static_cast<std::uint32_t>(iy) * kY;
    const std::uint32_t z0 = static_cast<std::uint32_t>(iz) * kZ;

    // Lanes: corners of the cell's low face in z, then of the high one; x fastest.
    const Uint4 corner = Uint4{x0, x0 + kX, x0, x0 + kX} ^ Uint4 { y0, y0, y0 + kY, y0 + kY };
    const Float4 dx = {x, x - 1.0f, x, x - 1.0f};
    const Float4 dy = {y, y, y - 1.0f, y - 1.0f};
    const Float4 low = slopes(corner ^ z0, dx, dy, Float4{z, z, z, z});
    const float z1 = z - 1.0f;
    const Float4 high = slopes(corner ^ (z0 + kZ), dx, dy, Float4{z1, z1, z1, z1});
    const Float4 face = low + (high - low) * fade(z);
    const float u = fade(x);
    const float front = face[0] + (face[1] - face[0]) * u;
    const float back = face[2] + (face[3] - face[2]) * u;
    constexpr float kScale = 1.35f / 1024.0f;
    return static_cast<double>((front + (back - front) * fade(y)) * kScale);
}

double gradient_noise(double x, std::uint32_t seed) {
    const std::int64_t cell = floor_to_int(x);
    const double t = x - static_cast<double>(cell);
    const auto left = static_cast<std::uint64_t>(cell);
    const double slope0 = 2.0 * hash_unit(seed, left) - 1.0;
    const double slope1 = 2.0 * hash_unit(seed, left + 1) - 1.0;
    return mix(slope0 * t, slope1 * (t - 1.0), fade(t));
}

double fractal_noise(const Vec3 &p, int octaves, std::uint32_t seed) {
    double sum = 0;
    double amplitude = 1;
    double frequency = 1;
    for (int octave = 0; octave < octaves; ++octave) {
        sum += amplitude * gradient_noise(p * frequency, seed + static_cast<std::uint32_t>(octave));
        amplitude *= 0.5;
        frequency *= 2.03; // not exactly 2, so that zeros of the octaves do not coincide
    }
    return sum;
}

} // namespace pbm::sample
