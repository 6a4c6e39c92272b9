// Random numbers and gradient noise from integer hashes: no tables, no state, the same values everywhere.
// Based on: Perlin. Improving Noise. 2002 (gradients at lattice points, quintic fade); gradients are bits of an integer
// hash instead of entries of a permutation table.
#pragma once

#include "deterministic_math.h"

#include <cstdint>

namespace pbm::sample {

// Mixes all bits of `value`. The finaliser of SplitMix64 (Steele, Lea, Flood. Fast Splittable Pseudorandom Number
// Generators. 2014).
inline std::uint64_t hash_bits(std::uint64_t value) {
    value += 0x9e3779b97f4a7c15ull;
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ull;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebull;
    return value ^ (value >> 31);
}

// Uniform in [0, 1), from the pair (seed, index).
inline double hash_unit(std::uint64_t seed, std::uint64_t index) {
    return static_cast<double>(hash_bits(seed ^ hash_bits(index)) >> 11) * 0x1p-53;
}

// Gradient noise in space: lattice spacing 1, zero at lattice points, in about [-1, 1] (standard deviation about 0.26),
// continuous second derivatives. Coordinates below 2^31 in magnitude.
double gradient_noise(const Vec3 &p, std::uint32_t seed);

// Gradient noise on a line: in [-1/2, 1/2], zero at integers.
double gradient_noise(double x, std::uint32_t seed);

// Sum of `octaves` noises, the first of amplitude 1, each next one of about twice the frequency and half the amplitude.
double fractal_noise(const Vec3 &p, int octaves, std::uint32_t seed);

} // namespace pbm::sample
