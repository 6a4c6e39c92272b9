// Improved Perlin noise, seeded, and band-limited sums of its octaves. docs/reference/solid-textures.md.
// Based on: Perlin. Improving Noise. 2002
//
// The same bits on every processor and compiler: single precision, each operation rounded once in a fixed order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace pbm::build {

using Permutation = std::array<std::uint8_t, 256>;

// The permutation of a seed: 0..255 shuffled by Fisher and Yates, from i = 255 down to 1, with
// j = ((r >> 32) * (i + 1)) >> 32, r the next number of splitmix64 that starts at the seed. Seed 0 is one like any
// other.
Permutation shuffled_permutation(std::uint32_t seed);

// Gradient noise with a lattice of 256 cells a side, then repeated; 0 at each lattice point, always within
// -kNoiseBound..kNoiseBound, of mean 0 and standard deviation 0.27. Coordinates are in cells, below 2^30.
class PerlinNoise {
  public:
    explicit PerlinNoise(std::uint32_t seed) : PerlinNoise(shuffled_permutation(seed)) {}
    explicit PerlinNoise(const Permutation &permutation);

    float at(float x, float y, float z) const;

    // [256]: the permutation's values of index i in bits 0..7 and of i + 1, wrapped, in bits 8..15.
    std::span<const std::int32_t, 256> pairs() const { return pairs_; }

  private:
    std::array<std::int32_t, 256> pairs_{};
};
inline constexpr float kNoiseBound = 1.04F;

// Amplitudes of octaves. Octave 0 is the noise itself; each further one lies on a lattice of half the cell, turned and
// shifted, so that zeros and axes of the lattices do not fall together.
inline constexpr int kMaxOctaves = 12;
struct Octaves {
    int count = 0;
    std::array<float, kMaxOctaves> amplitudes{};
};

// At most `most` octaves of amplitudes 1, gain, gain^2, ..., without those that samples cannot carry: an octave whose
// cell is four samples or more is there in full, one of two samples or less is not, between them it fades linearly.
// `samples_per_cell`: of octave 0.
Octaves band_limited_octaves(double samples_per_cell, int most, float gain = 0.5F);

enum class OctaveSum : std::uint8_t {
    signed_noise,  // fractal Brownian motion: sum of amplitude x noise
    absolute_noise // turbulence: sum of amplitude x |noise|
};

// Places of many samples, arrays of equal length.
struct SamplePlaces {
    std::span<const float> x, y, z;
};

// sums[i] = sum over octaves k, in order, of amplitude k x noise at place i, by vector instructions.
void sum_octaves(const PerlinNoise &noise, const Octaves &octaves, OctaveSum sum, const SamplePlaces &places,
                 std::span<float> sums);
// The same one by one: what the vector instructions are compared with.
void sum_octaves_singly(const PerlinNoise &noise, const Octaves &octaves, OctaveSum sum, const SamplePlaces &places,
                        std::span<float> sums);
using OctaveSummer = decltype(sum_octaves);

} // namespace pbm::build
