// Gradient noise of noise.h with its derivatives, four points at a time.
// Based on: Perlin. Improving Noise. 2002. Derivatives as in Quilez. Gradient Noise Derivatives. 2017.
#pragma once

#include "jet.h"

namespace pbm::sample {

namespace lattice {

// Mixes the bits of a lattice point's number.
inline Uint4 mixed(Uint4 h) {
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    return h ^ h >> 15;
}

inline constexpr std::uint32_t kX = 0x8da6b343u, kY = 0xd8163841u, kZ = 0xcb1ab31fu, kSeed = 0x9e3779b1u;

inline Float4 fade(Float4 t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); }
inline Float4 fade_slope(Float4 t) { return 30.0f * t * t * (t * (t - 2.0f) + 1.0f); }

// a + (b - a) * fade(t), where t is the coordinate number `axis`.
template <int D> Jet<D> blend(const Jet<D> &a, const Jet<D> &b, Float4 faded, Float4 faded_slope, int axis) {
    Jet<D> out{a.value + (b.value - a.value) * faded, {}};
    for (int i = 0; i < D; ++i)
        out.slope[i] = a.slope[i] + (b.slope[i] - a.slope[i]) * faded;
    out.slope[axis] += (b.value - a.value) * faded_slope;
    return out;
}

// Gradients at four lattice points, from the points' numbers. Components are uniform in [-1.3, 1.3] in the plane and
// [-1.35, 1.35] in space.
struct Gradient2 {
    Float4 x, y;
};
struct Gradient3 {
    Float4 x, y, z;
};
inline Gradient2 gradient2(Uint4 h) {
    constexpr float kScale = 1.3f / 32768.0f;
    h = mixed(h);
    return {to_float((Int4)(h & 0xffffu) - 0x8000) * kScale, to_float((Int4)(h >> 16) - 0x8000) * kScale};
}
inline Gradient3 gradient3(Uint4 h) {
    constexpr float kScale = 1.35f / 1024.0f;
    h = mixed(h);
    return {to_float((Int4)(h & 0x7ffu) - 0x400) * kScale, to_float((Int4)(h >> 11 & 0x7ffu) - 0x400) * kScale,
            to_float((Int4)(h >> 21) - 0x400) * kScale};
}

// A lattice point's linear function: its gradient times the offset from it.
inline Jet2 corner(const Gradient2 &g, Float4 x, Float4 y) { return {g.x * x + g.y * y, {g.x, g.y}}; }
inline Jet3 corner(const Gradient3 &g, Float4 x, Float4 y, Float4 z) {
    return {g.x * x + g.y * y + g.z * z, {g.x, g.y, g.z}};
}

// Four corners of a face of a cell, x fastest.
template <class Gradient> struct Face { Gradient corner[4]; };

// The corners of one cell, one per lane.
inline Uint4 face_of_cell(std::uint32_t ix, std::uint32_t iy, std::uint32_t seed) {
    const std::uint32_t x0 = ix * kX + seed * kSeed, x1 = x0 + kX, y0 = iy * kY, y1 = y0 + kY;
    return Uint4{x0 ^ y0, x1 ^ y0, x0 ^ y1, x1 ^ y1};
}

// The corners of four cells, one cell per lane.
struct FourFaces {
    Uint4 corner[4];
};
inline FourFaces faces_of_cells(Int4 ix, Int4 iy, std::uint32_t seed) {
    const Uint4 x0 = (Uint4)ix * kX + seed * kSeed, x1 = x0 + kX;
    const Uint4 y0 = (Uint4)iy * kY, y1 = y0 + kY;
    return {{x0 ^ y0, x1 ^ y0, x0 ^ y1, x1 ^ y1}};
}

inline Int4 first_lane(Int4 a) { return Int4{a[0], a[0], a[0], a[0]}; }

} // namespace lattice

// Coordinates below 2^22 in magnitude, where single precision still resolves a quarter. Zero at lattice points, lattice
// spacing 1, continuous second derivatives.

// Neighbouring points mostly share their cell: then the gradients at its corners are computed once, in the lanes of one
// vector, instead of once per point.

// In the plane: in about [-1, 1], standard deviation about 0.27.
inline Jet2 gradient_noise(Float4 x, Float4 y, std::uint32_t seed) {
    using namespace lattice;
    const Int4 ix = floor_to_int(x), iy = floor_to_int(y);
    x -= to_float(ix);
    y -= to_float(iy);
    Face<Gradient2> g;
    if (!any((ix ^ first_lane(ix)) | (iy ^ first_lane(iy)))) {
        const Gradient2 shared =
            gradient2(face_of_cell(static_cast<std::uint32_t>(ix[0]), static_cast<std::uint32_t>(iy[0]), seed));
        for (int i = 0; i < 4; ++i)
            g.corner[i] = {all(shared.x[i]), all(shared.y[i])};
    } else {
        const FourFaces faces = faces_of_cells(ix, iy, seed);
        for (int i = 0; i < 4; ++i)
            g.corner[i] = gradient2(faces.corner[i]);
    }
    const Float4 u = fade(x), du = fade_slope(x);
    const Jet2 low = blend(corner(g.corner[0], x, y), corner(g.corner[1], x - 1.0f, y), u, du, 0);
    const Jet2 high = blend(corner(g.corner[2], x, y - 1.0f), corner(g.corner[3], x - 1.0f, y - 1.0f), u, du, 0);
    return blend(low, high, fade(y), fade_slope(y), 1);
}

// In space: in about [-1, 1], standard deviation about 0.26.
inline Jet3 gradient_noise(Float4 x, Float4 y, Float4 z, std::uint32_t seed) {
    using namespace lattice;
    const Int4 ix = floor_to_int(x), iy = floor_to_int(y), iz = floor_to_int(z);
    x -= to_float(ix);
    y -= to_float(iy);
    z -= to_float(iz);
    Face<Gradient3> near, far;
    if (!any((ix ^ first_lane(ix)) | (iy ^ first_lane(iy)) | (iz ^ first_lane(iz)))) {
        const Uint4 face = face_of_cell(static_cast<std::uint32_t>(ix[0]), static_cast<std::uint32_t>(iy[0]), seed);
        const std::uint32_t z0 = static_cast<std::uint32_t>(iz[0]) * kZ;
        const Gradient3 low = gradient3(face ^ z0), high = gradient3(face ^ (z0 + kZ));
        for (int i = 0; i < 4; ++i) {
            near.corner[i] = {all(low.x[i]), all(low.y[i]), all(low.z[i])};
            far.corner[i] = {all(high.x[i]), all(high.y[i]), all(high.z[i])};
        }
    } else {
        const FourFaces faces = faces_of_cells(ix, iy, seed);
        const Uint4 z0 = (Uint4)iz * kZ;
        for (int i = 0; i < 4; ++i) {
            near.corner[i] = gradient3(faces.corner[i] ^ z0);
            far.corner[i] = gradient3(faces.corner[i] ^ (z0 + kZ));
        }
    }
    const Float4 u = fade(x), du = fade_slope(x), v = fade(y), dv = fade_slope(y);
    const auto layer = [&](const Face<Gradient3> &g, Float4 dz) {
        const Jet3 low = blend(corner(g.corner[0], x, y, dz), corner(g.corner[1], x - 1.0f, y, dz), u, du, 0);
        const Jet3 high =
            blend(corner(g.corner[2], x, y - 1.0f, dz), corner(g.corner[3], x - 1.0f, y - 1.0f, dz), u, du, 0);
        return blend(low, high, v, dv, 1);
    };
    return blend(layer(near, z), layer(far, z - 1.0f), fade(z), fade_slope(z), 2);
}

// Noise of coordinates that are functions themselves, times `frequency`.
template <int D> Jet<D> noise_of(const Jet<D> &x, const Jet<D> &y, float frequency, std::uint32_t seed) {
    const Jet2 n = gradient_noise(x.value * frequency, y.value * frequency, seed);
    Jet<D> out{n.value, {}};
    for (int i = 0; i < D; ++i)
        out.slope[i] = (n.slope[0] * x.slope[i] + n.slope[1] * y.slope[i]) * frequency;
    return out;
}

} // namespace pbm::sample
