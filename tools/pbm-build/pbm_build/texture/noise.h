// Improved Perlin noise, seeded, and band-limited sums of its octaves. docs/reference/solid-textures.md.
// Based on: Perlin. Improving Noise. 2002
//
// The same bits on every processor and compiler: single precision, each operation rounded once in a fixed order.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace pbm::build {

// A step of splitmix64: its state grows by kGolden, its number is the scrambled state.
inline constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;
constexpr std::uint64_t scramble(std::uint64_t value) {
    value = (value ^ value >> 30) * 0xBF58476D1CE4E5B9;
    value = (value ^ value >> 27) * 0x94D049BB133111EB;
    return value ^ value >> 31;
}

using Permutation = std::array<std::uint8_t, 256>;

// The permutation of a seed: 0..255 shuffled by Fisher and Yates, from i = 255 down to 1, with
// j = ((r >> 32) * (i + 1)) >> 32, r the next number of splitmix64 that starts at the seed. Seed 0 is one like any
// other.
Permutation shuffled_permutation(std::uint32_t seed);

// Gradient noise on a lattice that repeats after 256 cells: 0 at lattice points, within -1.04..1.04, mean 0, standard
// deviation 0.27. Coordinates are in cells, below 2^30.
class PerlinNoise {
  public:
    explicit PerlinNoise(std::uint32_t seed) : PerlinNoise(shuffled_permutation(seed)) {}
    explicit PerlinNoise(const Permutation &permutation);

    // [256]: the permutation's values of index i in bits 0..7 and of i + 1, wrapped, in bits 8..15.
    std::span<const std::int32_t, 256> pairs() const { return pairs_; }

  private:
    std::array<std::int32_t, 256> pairs_{};
};

// Amplitudes of octaves. Octave 0 is the noise itself. Each further octave has half the cell, turned and shifted, so
// that zeros and axes of the lattices do not coincide.
inline constexpr int kMaxOctaves = 12;
struct Octaves {
    int count = 0;
    std::array<float, kMaxOctaves> amplitudes{};
};

// At most `most` octaves of amplitudes 1, gain, gain^2, ..., limited to the sampling rate: an octave has its full
// amplitude if a cell spans four samples or more, none at two or less, a linear ramp between. `samples_per_cell`: of
// octave 0.
Octaves band_limited_octaves(double samples_per_cell, int most, float gain = 0.5F);

// Coordinates of samples, arrays of equal length.
struct SamplePlaces {
    std::span<const float> x, y, z;
};

// sums[i] = sum over octaves k, in order, of amplitude k x noise at place i.
void sum_octaves(const PerlinNoise &noise, const Octaves &octaves, const SamplePlaces &places, std::span<float> sums);

inline float clamped(float value, float low, float high) { return value < low ? low : value > high ? high : value; }
// 0 up to `low`, 1 from `high` on, a cubic between them.
inline float smooth_step(float low, float high, float value) {
    const float t = clamped((value - low) / (high - low), 0, 1);
    return t * t * (3 - 2 * t);
}

} // namespace pbm::build
