#include "statue_shape.h"

#include "pbm-sample/noise/jet_noise.h"

namespace pbm::sample {

namespace {

Float4 dot(const Lanes3 &a, const Lanes3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// A point and its direction, with their derivatives by the point's coordinates.
struct JetPoint {
    Jet3 x, y, z;
    Jet3 dx, dy, dz; // direction
};

JetPoint with_slopes(const CapsulePlace &place) {
    const Lanes3 at = place.position();
    JetPoint p{coordinate<3>(at.x, 0), coordinate<3>(at.y, 1), coordinate<3>(at.z, 2), {}, {}, {}};
    p.dx = {place.direction.x, {all(1 / kCapsule), all(0), all(0)}};
    p.dy = {place.direction.y, {}};
    const Int4 on_side = (Int4)(place.direction.y == 0.0f);
    p.dy.slope[1] = choose(on_side, all(0), all(1 / kCapsule)); // the direction is level along the line
    p.dz = {place.direction.z, {all(0), all(0), all(1 / kCapsule)}};
    return p;
}

Jet3 noise_at(const JetPoint &p, float x, float y, float z, std::uint32_t seed) {
    Jet3 n = gradient_noise(p.x.value * x, p.y.value * y, p.z.value * z, seed);
    n.slope[0] *= x;
    n.slope[1] *= y;
    n.slope[2] *= z;
    return n;
}

// A swelling of the surface, or a hollow if `height` is negative, within an ellipsoid of the capsule's space.
struct Swelling {
    float x, y, z;    // centre
    float rx, ry, rz; // radii
    float height;
};

Jet3 swelling(const JetPoint &p, const Swelling &s) {
    const Jet3 inside = 1.0f - (square((p.x + -s.x) * (1 / s.rx)) + square((p.y + -s.y) * (1 / s.ry)) +
                                square((p.z + -s.z) * (1 / s.rz)));
    const Float4 a = larger(inside.value, all(0));
    return chain(inside, a * a * a * s.height, 3.0f * s.height * a * a);
}

constexpr Swelling kHead[] = {
    {0, 0.712f, 0.20f, 0.036f, 0.062f, 0.10f, 0.026f},       // nose
    {0, 0.785f, 0.19f, 0.130f, 0.026f, 0.10f, 0.007f},       // brow
    {0.068f, 0.748f, 0.19f, 0.046f, 0.030f, 0.08f, -0.011f}, // eyes
    {-0.068f, 0.748f, 0.19f, 0.046f, 0.030f, 0.08f, -0.011f}, {0.068f, 0.748f, 0.19f, 0.026f, 0.018f, 0.06f, 0.007f},
    {-0.068f, 0.748f, 0.19f, 0.026f, 0.018f, 0.06f, 0.007f},  {0, 0.668f, 0.20f, 0.050f, 0.013f, 0.08f, 0.006f}, // lips
    {0, 0.656f, 0.20f, 0.056f, 0.008f, 0.08f, -0.005f},       {0, 0.643f, 0.20f, 0.042f, 0.013f, 0.08f, 0.007f},
    {0, 0.610f, 0.20f, 0.070f, 0.038f, 0.12f, 0.016f},   // chin
    {0, 0.720f, -0.20f, 0.110f, 0.090f, 0.12f, 0.050f}}; // knot of hair

constexpr Swelling kBody[] = {{0.20f, 0.24f, 0.01f, 0.13f, 0.26f, 0.13f, 0.050f}, // upper arms
                              {-0.20f, 0.24f, 0.01f, 0.13f, 0.26f, 0.13f, 0.050f},
                              {0.12f, 0.10f, 0.16f, 0.14f, 0.055f, 0.13f, 0.050f}, // forearms
                              {-0.12f, 0.10f, 0.16f, 0.14f, 0.055f, 0.13f, 0.050f},
                              {0, 0.12f, 0.20f, 0.07f, 0.045f, 0.09f, 0.040f}, // hands
                              {0.078f, 0.29f, 0.185f, 0.085f, 0.080f, 0.10f, 0.026f},
                              {-0.078f, 0.29f, 0.185f, 0.085f, 0.080f, 0.10f, 0.026f}};

// A block with rounded edges, seen from its centre: |x|^8 + |y|^8 + |z|^8 = 1.
Jet3 plinth(const JetPoint &p) {
    const Jet3 sum = square(square(square(p.dx * (1 / 0.27f)))) + square(square(square(p.dy * (1 / 0.10f)))) +
                     square(square(square(p.dz * (1 / 0.27f))));
    return inverse(square_root(square_root(square_root(sum))));
}

// Ellipses upon each other, and half an ellipsoid on top.
Jet3 figure(const JetPoint &p) {
    const Jet3 &y = p.y;
    const Jet3 mean = smooth_step(-0.70f, -0.15f, y) * -0.050f + smooth_step(-0.20f, 0.10f, y) * -0.040f +
                      smooth_step(0.10f, 0.30f, y) * 0.030f + smooth_step(0.385f, 0.50f, y) * -0.100f +
                      smooth_step(0.56f, 0.68f, y) * 0.045f + 0.220f;
    const Jet3 wide = smooth_step(-0.40f, -0.10f, y) * 0.18f + smooth_step(0.08f, 0.34f, y) * 0.25f +
                      smooth_step(0.40f, 0.49f, y) * -0.43f + smooth_step(0.56f, 0.64f, y) * -0.12f + 1.0f;
    const Jet3 deep = smooth_step(-0.40f, 0.0f, y) * -0.15f + smooth_step(0.42f, 0.52f, y) * 0.15f +
                      smooth_step(0.56f, 0.64f, y) * 0.05f + 1.0f;
    return mean * inverse(square_root(square(p.dx * inverse(wide)) + square(p.dy * (1 / 1.25f)) +
                                      square(p.dz * inverse(deep))));
}

Float4 hollow(const Jet3 &height, float deepest) { return clamp01(height.value * (-1 / deepest)); }

// Folds of the robe, long below the belt and slanting above it.
Jet3 folds(const JetPoint &p, std::uint32_t seed, Float4 &cavity) {
    Jet3 sum = constant<3>(all(0));
    if (any((Int4)(p.y.value < 0.095f))) {
        const Jet3 where = smooth_step(-0.715f, -0.60f, p.y) * (1.0f - smooth_step(-0.05f, 0.09f, p.y));
        const Jet3 fold = (rounded_abs(noise_at(p, 15.0f, 1.3f, 15.0f, seed + 1), 0.05f) * 3.0f + -0.65f) * where;
        sum = sum + fold * 0.020f;
        cavity = larger(cavity, hollow(fold, 0.7f));
    }
    if (any((Int4)(p.y.value > 0.0f)) && any((Int4)(p.y.value < 0.50f))) {
        const Jet3 where = smooth_step(0.10f, 0.20f, p.y) * (1.0f - smooth_step(0.36f, 0.48f, p.y));
        const Jet3 fold = (rounded_abs(noise_at(p, 7.0f, 13.0f, 9.0f, seed + 2), 0.06f) * 3.0f + -0.65f) * where;
        sum = sum + fold * 0.006f;
        cavity = larger(cavity, 0.5f * hollow(fold, 0.8f));
    }
    return sum + smooth_step(0.035f, 0.050f, p.y) * (1.0f - smooth_step(0.075f, 0.090f, p.y)) * 0.007f; // belt
}

// Waves of hair on the skull, except for the face and the neck.
Jet3 hair(const JetPoint &p, std::uint32_t seed, Float4 &cavity) {
    const Jet3 face = smooth_step(0.30f, 0.48f, p.dz) * (1.0f - smooth_step(0.42f, 0.58f, p.dy));
    const Jet3 where = smooth_step(0.595f, 0.635f, p.y) * (1.0f - face);
    const Jet3 wave = rounded_abs(noise_at(p, 24.0f, 42.0f, 24.0f, seed + 3), 0.04f) * 3.0f + -0.7f;
    cavity = larger(cavity, hollow(wave * where, 0.6f));
    return where * (wave * 0.006f + 0.011f);
}

} // namespace

CapsulePlace capsule_place(Float4 u, Float4 v) {
    constexpr float kLine = kLineHigh - kLineLow;
    constexpr float kCap = kCapsule * 1.57079632679489661923f; // from pole to side
    const Float4 along = u * (kLine + 2 * kCap);
    const Float4 on_line = smaller(larger(along - kCap, all(0)), all(kLine));
    const Float4 elevation = (along - kCap - on_line) * (0.25f / kCap); // turns
    Float4 up, level, sine, cosine;
    sin_cos_turns(elevation, up, level);
    sin_cos_turns(v, sine, cosine);
    return {{level * sine, up, -level * cosine}, on_line + kLineLow};
}

CapsulePlace capsule_place(const Lanes3 &point) {
    const Float4 line_y = smaller(larger(point.y, all(kLineLow)), all(kLineHigh));
    const Lanes3 off{point.x, point.y - line_y, point.z};
    const Float4 scale = 1.0f / square_root(dot(off, off));
    return {{off.x * scale, off.y * scale, off.z * scale}, line_y};
}

StatueRadius statue_radius(const CapsulePlace &place, std::uint32_t seed) {
    const JetPoint p = with_slopes(place);
    StatueRadius out{constant<3>(all(0)), all(0)};
    Jet3 body = constant<3>(all(0));
    if (any((Int4)(p.y.value > -0.74f))) {
        body = figure(p) + folds(p, seed, out.cavity);
        if (any((Int4)(p.y.value > 0.55f))) {
            for (const Swelling &s : kHead)
                body = body + swelling(p, s);
            body = body + hair(p, seed, out.cavity);
        }
        if (any((Int4)(p.y.value > -0.05f)) && any((Int4)(p.y.value < 0.55f)))
            for (const Swelling &s : kBody)
                body = body + swelling(p, s);
    }
    out.radius = body;
    if (any((Int4)(p.y.value < -0.68f)))
        out.radius = mix(plinth(p), body, smooth_step(-0.725f, -0.690f, p.y));

    // The stone: marks of the chisel, and pits of the weather.
    float frequency = 55.0f, height = 0.0011f;
    for (std::uint32_t octave = 0; octave < 3; ++octave) {
        out.radius = out.radius + noise_at(p, frequency, frequency, frequency, seed + 10 + octave) * height;
        frequency *= 2.17f;
        height *= 0.45f;
    }
    const Jet3 pit = smooth_step(0.42f, 0.60f, noise_at(p, 47.0f, 47.0f, 47.0f, seed + 13));
    out.radius = out.radius + pit * -0.0015f;
    out.cavity = larger(out.cavity, 0.4f * pit.value);
    return out;
}

// The gradient of (distance from the line - radius(place)), of unit length. Where the point moves by 1 along the
// surface, its place moves by kCapsule / radius, except along the line, where it moves by 1.
Lanes3 statue_normal(const CapsulePlace &place, const Jet3 &radius) {
    const Lanes3 &n = place.direction;
    const Lanes3 slope{radius.slope[0], radius.slope[1], radius.slope[2]};
    const Float4 along = dot(slope, n);
    const Float4 shrink = kCapsule / radius.value;
    const Float4 shrink_y = choose((Int4)(n.y == 0.0f), all(1), shrink);
    const Lanes3 a{n.x - shrink * (slope.x - along * n.x), n.y - shrink_y * (slope.y - along * n.y),
                   n.z - shrink * (slope.z - along * n.z)};
    const Float4 scale = 1.0f / square_root(dot(a, a));
    return {a.x * scale, a.y * scale, a.z * scale};
}

} // namespace pbm::sample
