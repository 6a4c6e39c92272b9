#include "pbm_build/texture/noise.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_build/texture/noise.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#ifndef PBM_OCTAVE_TURN // once for all targets
#define PBM_OCTAVE_TURN
namespace pbm::build {
namespace {

// Twice the rotation of the quaternion (3, 1, 2, -1), and a shift that moves the common fixed point of the octaves away
// from the origin.
constexpr std::array<std::array<float, 3>, 3> kTurn{{{10.0F / 15, 20.0F / 15, 20.0F / 15},
                                                     {-4.0F / 15, 22.0F / 15, -20.0F / 15},
                                                     {-28.0F / 15, 4.0F / 15, 10.0F / 15}}};
constexpr std::array<float, 3> kShift{12.71F, 31.37F, 23.93F};

// Directions of the twelve edges of a cube by the low four bits of a hash; four occur twice.
constexpr std::array<std::array<float, 3>, 16> kEdges{{{1, 1, 0},
                                                       {-1, 1, 0},
                                                       {1, -1, 0},
                                                       {-1, -1, 0},
                                                       {1, 0, 1},
                                                       {-1, 0, 1},
                                                       {1, 0, -1},
                                                       {-1, 0, -1},
                                                       {0, 1, 1},
                                                       {0, -1, 1},
                                                       {0, 1, -1},
                                                       {0, -1, -1},
                                                       {1, 1, 0},
                                                       {0, -1, 1},
                                                       {-1, 1, 0},
                                                       {0, -1, -1}}};

// Hashes of a cell's corners, x fastest.
using CornerHashes = std::array<std::uint8_t, 8>;
CornerHashes corner_hashes(const std::int32_t *pairs, std::int32_t x, std::int32_t y, std::int32_t z) {
    const auto pair = [pairs](std::int32_t index) { return pairs[index & 255]; };
    const std::int32_t column = pair(x);
    const std::int32_t left = pair((column & 255) + y), right = pair((column >> 8) + y);
    CornerHashes hashes{};
    for (const std::size_t j : {0U, 1U}) {
        const std::int32_t at_left = pair((left >> 8 * j & 255) + z), at_right = pair((right >> 8 * j & 255) + z);
        const std::size_t corner = 2 * j;
        hashes[corner] = static_cast<std::uint8_t>(at_left);
        hashes[corner + 1] = static_cast<std::uint8_t>(at_right);
        hashes[corner + 4] = static_cast<std::uint8_t>(at_left >> 8);
        hashes[corner + 5] = static_cast<std::uint8_t>(at_right >> 8);
    }
    return hashes;
}

} // namespace
} // namespace pbm::build
#endif

HWY_BEFORE_NAMESPACE();
namespace pbm::build::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Vector = hn::Vec<Floats>;
using IntVector = hn::Vec<Ints>;

HWY_INLINE Vector fade(Vector t) {
    const Floats d;
    const Vector cubed = hn::Mul(hn::Mul(t, t), t);
    const Vector slope = hn::Sub(hn::Mul(t, hn::Set(d, 6)), hn::Set(d, 15));
    return hn::Mul(cubed, hn::Add(hn::Mul(t, slope), hn::Set(d, 10)));
}

HWY_INLINE Vector mix(Vector t, Vector a, Vector b) { return hn::Add(a, hn::Mul(t, hn::Sub(b, a))); }

// One of the twelve edge directions of a cube, by the low four bits of `hash`, times (x, y, z).
HWY_INLINE Vector slope(IntVector hash, Vector x, Vector y, Vector z) {
    const Floats d;
    const Ints di;
    const IntVector low = hn::And(hash, hn::Set(di, 15));
    const Vector u = hn::IfThenElse(hn::RebindMask(d, hn::Lt(low, hn::Set(di, 8))), x, y);
    const auto takes_x = hn::Eq(hn::And(hash, hn::Set(di, 13)), hn::Set(di, 12));
    const Vector x_or_z = hn::IfThenElse(hn::RebindMask(d, takes_x), x, z);
    const Vector v = hn::IfThenElse(hn::RebindMask(d, hn::Lt(low, hn::Set(di, 4))), y, x_or_z);
    const Vector sign_u = hn::BitCast(d, hn::ShiftLeft<31>(hash));
    const Vector sign_v = hn::And(hn::BitCast(d, hn::ShiftLeft<30>(hash)), hn::SignBit(d));
    return hn::Add(hn::Xor(u, sign_u), hn::Xor(v, sign_v));
}

// The same for one hash in all lanes: a sum in which one of three terms is zero.
HWY_INLINE Vector common_slope(std::uint8_t hash, Vector x, Vector y, Vector z) {
    const Floats d;
    const float *const edge = kEdges[hash & 15].data();
    const Vector xy = hn::Add(hn::Mul(hn::Set(d, edge[0]), x), hn::Mul(hn::Set(d, edge[1]), y));
    return hn::Add(xy, hn::Mul(hn::Set(d, edge[2]), z));
}

// The hashes at `index` and `index` + 1, mod 256.
struct HashPair {
    IntVector low, high;
};
HWY_INLINE HashPair hash_pair(const std::int32_t *pairs, IntVector index) {
    const Ints di;
    const IntVector pair = hn::GatherIndex(di, pairs, hn::And(index, hn::Set(di, 255)));
    return {.low = hn::And(pair, hn::Set(di, 255)), .high = hn::ShiftRight<8>(pair)};
}

HWY_INLINE Vector noise_at(const std::int32_t *pairs, Vector px, Vector py, Vector pz) {
    const Floats d;
    const Ints di;
    const Vector one = hn::Set(d, 1);
    const Vector floor_x = hn::Floor(px), floor_y = hn::Floor(py), floor_z = hn::Floor(pz);
    const Vector x = hn::Sub(px, floor_x), y = hn::Sub(py, floor_y), z = hn::Sub(pz, floor_z);
    const Vector x1 = hn::Sub(x, one), y1 = hn::Sub(y, one), z1 = hn::Sub(z, one);
    const Vector u = fade(x), v = fade(y), w = fade(z);

    // Fast path for a vector of points in one cell, which is common, since points are sorted along a curve.
    const float first_x = hn::GetLane(floor_x), first_y = hn::GetLane(floor_y), first_z = hn::GetLane(floor_z);
    const auto same_xy = hn::And(hn::Eq(floor_x, hn::Set(d, first_x)), hn::Eq(floor_y, hn::Set(d, first_y)));
    if (hn::AllTrue(d, hn::And(same_xy, hn::Eq(floor_z, hn::Set(d, first_z))))) {
        const CornerHashes hashes =
            corner_hashes(pairs, static_cast<std::int32_t>(first_x), static_cast<std::int32_t>(first_y),
                          static_cast<std::int32_t>(first_z));
        const auto corner = [&](int number, Vector at_x, Vector at_y, Vector at_z) {
            return common_slope(hashes[static_cast<std::size_t>(number)], at_x, at_y, at_z);
        };
        const Vector below =
            mix(v, mix(u, corner(0, x, y, z), corner(1, x1, y, z)), mix(u, corner(2, x, y1, z), corner(3, x1, y1, z)));
        const Vector above = mix(v, mix(u, corner(4, x, y, z1), corner(5, x1, y, z1)),
                                 mix(u, corner(6, x, y1, z1), corner(7, x1, y1, z1)));
        return mix(w, below, above);
    }

    const IntVector cell_y = hn::ConvertTo(di, floor_y), cell_z = hn::ConvertTo(di, floor_z);
    const HashPair column = hash_pair(pairs, hn::ConvertTo(di, floor_x));
    const HashPair left = hash_pair(pairs, hn::Add(column.low, cell_y));
    const HashPair right = hash_pair(pairs, hn::Add(column.high, cell_y));
    const HashPair h00 = hash_pair(pairs, hn::Add(left.low, cell_z));
    const HashPair h01 = hash_pair(pairs, hn::Add(left.high, cell_z));
    const HashPair h10 = hash_pair(pairs, hn::Add(right.low, cell_z));
    const HashPair h11 = hash_pair(pairs, hn::Add(right.high, cell_z));

    const Vector below = mix(v, mix(u, slope(h00.low, x, y, z), slope(h10.low, x1, y, z)),
                             mix(u, slope(h01.low, x, y1, z), slope(h11.low, x1, y1, z)));
    const Vector above = mix(v, mix(u, slope(h00.high, x, y, z1), slope(h10.high, x1, y, z1)),
                             mix(u, slope(h01.high, x, y1, z1), slope(h11.high, x1, y1, z1)));
    return mix(w, below, above);
}

HWY_INLINE Vector turn(std::size_t row, Vector x, Vector y, Vector z) {
    const Floats d;
    const Vector xy = hn::Add(hn::Mul(hn::Set(d, kTurn[row][0]), x), hn::Mul(hn::Set(d, kTurn[row][1]), y));
    return hn::Add(hn::Add(xy, hn::Mul(hn::Set(d, kTurn[row][2]), z)), hn::Set(d, kShift[row]));
}

HWY_INLINE Vector sum_at(const std::int32_t *pairs, const Octaves &octaves, Vector x, Vector y, Vector z) {
    const Floats d;
    Vector sum = hn::Zero(d);
    for (std::size_t k = 0; k < static_cast<std::size_t>(octaves.count); ++k) {
        if (k > 0) {
            const Vector next_x = turn(0, x, y, z), next_y = turn(1, x, y, z);
            z = turn(2, x, y, z);
            x = next_x;
            y = next_y;
        }
        const Vector noise = noise_at(pairs, x, y, z);
        sum = hn::Add(sum, hn::Mul(hn::Set(d, octaves.amplitudes[k]), noise));
    }
    return sum;
}

void sum_octaves(const std::int32_t *pairs, const Octaves &octaves, const SamplePlaces &places, std::span<float> sums) {
    const Floats d;
    const std::size_t lanes = hn::Lanes(d);
    std::size_t i = 0;
    for (; i + lanes <= sums.size(); i += lanes)
        hn::StoreU(sum_at(pairs, octaves, hn::LoadU(d, places.x.data() + i), hn::LoadU(d, places.y.data() + i),
                          hn::LoadU(d, places.z.data() + i)),
                   d, sums.data() + i);
    const std::size_t left = sums.size() - i;
    if (left == 0)
        return;
    std::array<std::array<float, hn::MaxLanes(Floats())>, 3> last{};
    std::copy_n(places.x.data() + i, left, last[0].data());
    std::copy_n(places.y.data() + i, left, last[1].data());
    std::copy_n(places.z.data() + i, left, last[2].data());
    hn::StoreU(sum_at(pairs, octaves, hn::LoadU(d, last[0].data()), hn::LoadU(d, last[1].data()),
                      hn::LoadU(d, last[2].data())),
               d, last[0].data());
    std::copy_n(last[0].data(), left, sums.data() + i);
}

} // namespace pbm::build::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm::build {

HWY_EXPORT(sum_octaves);

Permutation shuffled_permutation(std::uint32_t seed) {
    Permutation permutation{};
    std::iota(permutation.begin(), permutation.end(), std::uint8_t{0});
    std::uint64_t state = seed;
    for (std::uint64_t i = 255; i > 0; --i)
        std::swap(permutation[i], permutation[(scramble(state += kGolden) >> 32) * (i + 1) >> 32]);
    return permutation;
}

PerlinNoise::PerlinNoise(const Permutation &permutation) {
    for (std::size_t i = 0; i < pairs_.size(); ++i)
        pairs_[i] = permutation[i] | permutation[(i + 1) % 256] << 8;
}

Octaves band_limited_octaves(double samples_per_cell, int most, float gain) {
    Octaves octaves;
    float amplitude = 1;
    for (; octaves.count < std::min(most, kMaxOctaves) && samples_per_cell > 2; ++octaves.count) {
        const double share = std::min(1.0, samples_per_cell / 2 - 1);
        octaves.amplitudes[static_cast<std::size_t>(octaves.count)] = amplitude * static_cast<float>(share);
        amplitude *= gain;
        samples_per_cell /= 2;
    }
    return octaves;
}

void sum_octaves(const PerlinNoise &noise, const Octaves &octaves, const SamplePlaces &places, std::span<float> sums) {
    assert(places.x.size() == sums.size() && places.y.size() == sums.size() && places.z.size() == sums.size());
    HWY_DYNAMIC_DISPATCH(sum_octaves)(noise.pairs().data(), octaves, places, sums);
}

} // namespace pbm::build
#endif
