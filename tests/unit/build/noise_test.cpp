// Perlin noise against its published definition, and the same bits on every processor.
#include "pbm_build/texture/noise.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

namespace pbm::build {
namespace {

// The permutation of Perlin's own program.
constexpr Permutation kPerlins{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,  69,  142,
    8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,  94,  252, 219, 203,
    117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136, 171, 168, 68,  175, 74,  165,
    71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,  41,
    55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,
    18,  169, 200, 196, 135, 130, 116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250,
    124, 123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189,
    28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,
    129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,
    242, 193, 238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,  222, 114,
    67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

// Random places in -range..range.
struct Places {
    Places(std::size_t count, float range) {
        for (std::vector<float> *const axis : {&x, &y, &z}) {
            const double step = axis == &x ? 0.8191725134 : axis == &y ? 0.6710436067 : 0.5497004779;
            for (std::size_t i = 0; i < count; ++i) {
                const double turns = static_cast<double>(i + 1) * step;
                axis->push_back(static_cast<float>(2 * (turns - std::floor(turns)) - 1) * range);
            }
        }
    }
    SamplePlaces view() const { return {x, y, z}; }
    std::vector<float> x, y, z;
};

// Perlin's own gradient: by the low four bits of a hash one of the twelve edge directions of a cube, times (x, y, z).
float gradient(int hash, float x, float y, float z) {
    const int h = hash & 15;
    const float u = h < 8 ? x : y, v = h < 4 ? y : h == 12 || h == 14 ? x : z;
    return ((h & 1) == 0 ? u : -u) + ((h & 2) == 0 ? v : -v);
}

float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }
float mix(float t, float a, float b) { return a + t * (b - a); }

// Scalar reference by the definition.
float perlin_noise(const Permutation &permutation, const std::array<float, 3> &place) {
    const float floor_x = std::floor(place[0]), floor_y = std::floor(place[1]), floor_z = std::floor(place[2]);
    const float x = place[0] - floor_x, y = place[1] - floor_y, z = place[2] - floor_z;
    const float u = fade(x), v = fade(y), w = fade(z);
    const auto p = [&](int at) { return static_cast<int>(permutation[static_cast<std::size_t>(at & 255)]); };
    const auto slope = [&](int i, int j, int k) {
        const int hash =
            p(p(p(static_cast<int>(floor_x) + i) + static_cast<int>(floor_y) + j) + static_cast<int>(floor_z) + k);
        return gradient(hash, x - static_cast<float>(i), y - static_cast<float>(j), z - static_cast<float>(k));
    };
    const auto layer = [&](int k) {
        return mix(v, mix(u, slope(0, 0, k), slope(1, 0, k)), mix(u, slope(0, 1, k), slope(1, 1, k)));
    };
    return mix(w, layer(0), layer(1));
}

// Between octaves: twice the rotation by the quaternion (3, 1, 2, -1), whose squared length is 15, and a shift;
// docs/reference/solid-textures.md.
std::array<float, 3> next_octave(const std::array<float, 3> &place) {
    constexpr float w = 3, x = 1, y = 2, z = -1;
    constexpr std::array<std::array<float, 3>, 3> kRotation{
        {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
         {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
         {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}}};
    constexpr std::array<float, 3> kShift{12.71F, 31.37F, 23.93F};
    std::array<float, 3> next{};
    for (std::size_t row = 0; row < 3; ++row)
        next[row] = 2 * kRotation[row][0] / 15 * place[0] + 2 * kRotation[row][1] / 15 * place[1] +
                    2 * kRotation[row][2] / 15 * place[2] + kShift[row];
    return next;
}

std::vector<float> expected_sums(std::uint32_t seed, const Octaves &octaves, const Places &places) {
    const Permutation permutation = shuffled_permutation(seed);
    std::vector<float> result(places.x.size(), 0);
    for (std::size_t i = 0; i < result.size(); ++i) {
        std::array<float, 3> place{places.x[i], places.y[i], places.z[i]};
        for (std::size_t k = 0; k < static_cast<std::size_t>(octaves.count); ++k) {
            place = k > 0 ? next_octave(place) : place;
            const float noise = perlin_noise(permutation, place);
            result[i] += octaves.amplitudes[k] * noise;
        }
    }
    return result;
}

std::vector<float> sums(std::uint32_t seed, const Octaves &octaves, const Places &places) {
    std::vector<float> result(places.x.size());
    sum_octaves(PerlinNoise(seed), octaves, places.view(), result);
    return result;
}

float noise_at(const PerlinNoise &noise, float x, float y, float z) {
    float value = 0;
    sum_octaves(noise, {.count = 1, .amplitudes = {1}}, {{&x, 1}, {&y, 1}, {&z, 1}}, {&value, 1});
    return value;
}

TEST(Noise, IsPerlins) {
    const PerlinNoise noise(kPerlins);
    EXPECT_NEAR(noise_at(noise, 3.14F, 42, 7), 0.13691995878400012, 1e-6);
    // In the middle of cell (0, 0, 0) each fade is 1/2: noise = mean of eight products.
    double mean = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
        const auto p = [](int at) { return static_cast<int>(kPerlins[static_cast<std::size_t>(at & 255)]); };
        const auto away = [](int at) { return 0.5F - static_cast<float>(at); };
        mean += static_cast<double>(gradient(p(p(p(i) + j) + k), away(i), away(j), away(k))) / 8;
    }
    EXPECT_NEAR(noise_at(noise, 0.5F, 0.5F, 0.5F), mean, 1e-6);
    EXPECT_NEAR(noise_at(noise, 256.5F, -255.5F, 512.5F), mean, 1e-6); // the noise repeats, also in negative cells
}

TEST(Noise, IsZeroAtLatticePoints) {
    const PerlinNoise noise(5);
    for (int i = -3; i < 300; ++i)
        EXPECT_EQ(noise_at(noise, static_cast<float>(i), static_cast<float>(7 * i), static_cast<float>(-i)), 0) << i;
}

TEST(Noise, SeedsArePermutations) {
    std::set<Permutation> seen;
    for (std::uint32_t seed = 0; seed < 200; ++seed) {
        Permutation permutation = shuffled_permutation(seed);
        seen.insert(permutation);
        std::sort(permutation.begin(), permutation.end());
        for (std::size_t i = 0; i < 256; ++i)
            ASSERT_EQ(permutation[i], i);
    }
    EXPECT_EQ(seen.size(), 200U);
    // splitmix64 of 0 starts with 0xE220A8397B1DCDAF (Vigna's program): 0xE220A839 x 256 >> 32 = 0xE2 goes last.
    EXPECT_EQ(shuffled_permutation(0)[255], 0xE2);
}

TEST(Noise, SameBitsFromEveryProcessor) {
    const Octaves octaves = band_limited_octaves(700, kMaxOctaves, 0.6F);
    for (const std::size_t count : {1U, 7U, 33U, 5000U}) {
        const Places places(count, 40);
        const std::vector<float> expected = expected_sums(3, octaves, places);
        int tried = 0;
        for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1, ++tried) {
            hwy::SetSupportedTargetsForTest(targets & -targets);
            EXPECT_EQ(sums(3, octaves, places), expected) << hwy::TargetName(targets & -targets);
        }
        hwy::SetSupportedTargetsForTest(0);
        EXPECT_GE(tried, 1);
    }
}

TEST(Noise, HasTheStatedMeanDeviationAndRange) {
    const std::vector<float> values = sums(1, band_limited_octaves(100, 1), Places(2000000, 128));
    double sum = 0, squares = 0;
    for (const float value : values) {
        ASSERT_LE(std::abs(value), 1.04F);
        sum += static_cast<double>(value);
        squares += static_cast<double>(value) * static_cast<double>(value);
    }
    const auto count = static_cast<double>(values.size());
    EXPECT_NEAR(sum / count, 0, 0.002);
    EXPECT_NEAR(std::sqrt(squares / count), 0.27, 0.01);
    EXPECT_GT(*std::max_element(values.begin(), values.end()), 0.85F);
    EXPECT_LT(*std::min_element(values.begin(), values.end()), -0.85F);
}

// Octaves are rotated against each other. Otherwise the noise on lattice lines would have less variance.
TEST(Noise, SumsOfOctavesDoNotShowTheLattice) {
    const Octaves octaves = band_limited_octaves(1e6, 6);
    const auto deviation = [&](float offset) {
        Places places(200000, 60);
        for (float &x : places.x)
            x = std::floor(x) + offset;
        for (float &y : places.y)
            y = std::floor(y) + offset;
        double squares = 0;
        for (const float value : sums(2, octaves, places))
            squares += static_cast<double>(value) * static_cast<double>(value);
        return std::sqrt(squares / 200000);
    };
    // One octave alone has deviation 0 on lattice lines (z = 0 too), and more than 0.2 between them.
    EXPECT_GT(deviation(0) / deviation(0.5F), 0.7);
}

TEST(Noise, OctavesEndWhereSamplesDo) {
    EXPECT_EQ(band_limited_octaves(2, 8).count, 0);
    EXPECT_EQ(band_limited_octaves(3, 8).count, 1);
    EXPECT_FLOAT_EQ(band_limited_octaves(3, 8).amplitudes[0], 0.5F);
    const Octaves octaves = band_limited_octaves(12, 8); // cells 12, 6 and 3 samples wide
    EXPECT_EQ(octaves.count, 3);
    EXPECT_FLOAT_EQ(octaves.amplitudes[0], 1);
    EXPECT_FLOAT_EQ(octaves.amplitudes[1], 0.5F);
    EXPECT_FLOAT_EQ(octaves.amplitudes[2], 0.125F);
    EXPECT_EQ(band_limited_octaves(1e9, 5).count, 5);
    EXPECT_EQ(band_limited_octaves(1e9, 50).count, kMaxOctaves);
}

// Along a line of samples the sum is smooth: no octave is finer than the samples.
TEST(Noise, SumsOfOctavesAreSmoothAtTheSamples) {
    constexpr double kSamplesPerCell = 64;
    const auto roughness = [&](const Octaves &octaves) { // mean squared second difference over mean squared value
        Places places(20000, 1);
        for (std::size_t i = 0; i < places.x.size(); ++i) {
            places.x[i] = static_cast<float>(static_cast<double>(i) / kSamplesPerCell);
            places.y[i] = 0.3F;
            places.z[i] = static_cast<float>(i - i % 512) * 0.0033F;
        }
        const auto values = sums(4, octaves, places);
        double second = 0, all = 0;
        for (std::size_t i = 1; i + 1 < values.size(); ++i) {
            if (i / 512 != (i - 1) / 512 || i / 512 != (i + 1) / 512)
                continue;
            const auto bend = static_cast<double>(values[i - 1] - 2 * values[i] + values[i + 1]);
            second += bend * bend;
            all += static_cast<double>(values[i]) * static_cast<double>(values[i]);
        }
        return second / all;
    };
    Octaves all;
    all.count = kMaxOctaves;
    all.amplitudes.fill(0.5F);
    Octaves limited = band_limited_octaves(kSamplesPerCell, kMaxOctaves, 1);
    EXPECT_LT(roughness(limited), 0.5 * roughness(all));
    EXPECT_LT(roughness(band_limited_octaves(kSamplesPerCell, kMaxOctaves)), 0.02);
}

} // namespace
} // namespace pbm::build
