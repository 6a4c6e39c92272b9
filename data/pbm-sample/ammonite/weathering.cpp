#include "weathering.h"

#include "pbm-sample/noise/noise.h"

#include <cmath>

namespace pbm::sample {

namespace {

using Rgb = Vec3; // sRGB values 0..255, mixed without conversion

Rgb mixed(const Rgb &a, const Rgb &b, double t) { return a + (b - a) * t; }

// Weight of detail of wavelength `wave` on a surface sampled at `spacing`: 0 where it would alias.
double resolved(double wave, double spacing) { return smooth_step(1.8, 3.5, wave / spacing); }

// A wave of round arches: 1 at integers, where they meet in points, and -1 in between.
double arches(double x) { return 1.0 - 2.0 * std::abs(sin_turns(0.5 * x)); }

// Position in the pattern of septa, which lie at integers plus one half. Across the flank a septum forms round saddles
// towards the aperture and pointed lobes away from it, repeated at finer scales, as in ammonites.
double septum_phase(double along, double flank) {
    const double f = flank + 0.020 * sin_turns(2.1 * along + 5.0 * flank);
    const double lobes = 0.33 * arches(2.7 * f + 0.34) * (0.45 + 0.75 * f);
    const double lobules = 0.12 * arches(8.1 * f + 0.3);
    const double frill = 0.050 * arches(22.0 * f + 1.1 * along);
    return along + lobes + lobules + frill;
}

// 1 on a suture line, 0 away from it. Lines are visible where the shell is gone and chambers lie below.
double suture(const Probe &at, double spacing) {
    if (at.part != Part::mould || at.turn > -0.42 || at.worn < 0.5 || at.flank < 0.05)
        return 0;
    const double along = at.turn * kSeptaPerTurn;
    const double step = 1e-4;
    const double phase = septum_phase(along, at.flank);
    const double da = (septum_phase(along + step, at.flank) - phase) / step;
    const double df = (septum_phase(along, at.flank + step) - phase) / step;
    const double turn_length = kTwoPi * at.radius * (0.5 + 0.45 * at.flank) / kSeptaPerTurn;
    const double flank_length = 0.62 * at.radius;
    const double slope = std::sqrt(da * da / (turn_length * turn_length) + df * df / (flank_length * flank_length));
    const double distance = std::abs(fraction(phase) - 0.5) / (slope + 1e-9);
    const double line = 0.0046 * std::sqrt(at.radius);
    const double width = std::max(line, 0.55 * spacing);
    const double visible = smooth_step(6.5, 2.2, spacing / line) * smooth_step(0.10, 0.30, at.radius);
    return visible * (1.0 - smooth_step(0.5 * width, width, distance));
}

// Openness of the surface: 0 deep in a crevice, about 1 on a plane, more on ridges.
double openness(const Shell &shell, const Vec3 &p, const Vec3 &n) {
    const double near_step = 0.014;
    const double far_step = 0.055;
    const double here = shell.outline(p);
    return 0.5 * ((shell.outline(p + n * near_step) - here) / near_step +
                  (shell.outline(p + n * far_step) - here) / far_step);
}

// Height of the fine relief above the extracted surface.
double relief(const Probe &at, const Vec3 &p, double spacing, double line, std::uint32_t seed) {
    const bool rock = at.part == Part::matrix || at.part == Part::infill;
    const double coarse = rock ? 1.6 : at.part == Part::mould ? 0.8 : 0.9;
    double height = 0;
    height += 0.0095 * coarse * resolved(0.040, spacing) * gradient_noise(p * 25.0, seed ^ 0x21u);
    height += 0.0024 * coarse * resolved(0.019, spacing) * gradient_noise(p * 53.0, seed ^ 0x22u);
    height += 0.0008 * coarse * resolved(0.009, spacing) * gradient_noise(p * 111.0, seed ^ 0x23u);
    height += 0.0004 * coarse * resolved(0.0042, spacing) * gradient_noise(p * 237.0, seed ^ 0x24u);
    // Pits where the noise is high, clustered by a slower noise.
    const double cluster = gradient_noise(p * 7.0, seed ^ 0x25u);
    const double pit = smooth_step(0.22, 0.62, gradient_noise(p * 61.0, seed ^ 0x26u) + 0.3 * cluster);
    height -= 0.0060 * pit * resolved(0.016, spacing);
    if (!rock) {
        // Growth lines follow the ribs.
        const double lines =
            gradient_noise(at.rib_phase * 9.0, seed ^ 0x27u) + 0.7 * gradient_noise(at.rib_phase * 21.0, seed ^ 0x28u);
        const double wave = 0.019 * at.radius;
        height += 0.0060 * at.radius * lines * (1.0 - 0.6 * at.worn) * resolved(wave, spacing);
    }
    height -= 0.0022 * line * resolved(0.008, spacing);
    return height;
}

// Noise of the scanner: independent noise per sample, and waves of a few samples from registration and merging.
double scanner_noise(const Vec3 &p, double spacing, std::uint32_t seed, std::uint64_t index) {
    const double inverse = 1.0 / spacing;
    double noise = 0.20 * (hash_unit(seed + 5u, index) + hash_unit(seed + 6u, index) - 1.0);
    noise += 0.22 * gradient_noise(p * (inverse / 2.7), seed ^ 0x31u);
    noise += 0.26 * gradient_noise(p * (inverse / 6.1), seed ^ 0x32u);
    noise += 0.25 * gradient_noise(p * (inverse / 14.3), seed ^ 0x33u);
    return noise * spacing;
}

Rgb stone_color(const Probe &at, const Vec3 &p, double tint, std::uint32_t seed) {
    const double patch = fractal_noise(p * 3.1, 3, seed ^ 0x41u);
    const double speck = gradient_noise(p * 83.0, seed ^ 0x43u);
    if (at.part == Part::matrix || at.part == Part::infill) {
        Rgb c = mixed({92, 84, 75}, {146, 133, 113}, clamp01(0.45 + 1.1 * patch));
        c = mixed(c, {94, 88, 82}, 0.8 * smooth_step(0.18, 0.42, speck));
        return mixed(c, {168, 160, 145}, 0.55 * smooth_step(0.20, 0.45, -speck));
    }
    const Rgb mould = mixed({178, 148, 102}, {134, 121, 104}, smooth_step(-0.45, 0.45, patch + 0.3 * tint));
    Rgb shell = mixed({104, 81, 60}, {160, 132, 98}, smooth_step(-0.5, 0.55, patch + 0.6 * tint));
    shell = mixed(shell, {128, 72, 46}, 0.5 * smooth_step(0.12, 0.55, fractal_noise(p * 1.7, 2, seed ^ 0x44u)));
    // Bands of growth; dust in the grooves.
    const double band = 1.0 + 0.16 * gradient_noise(at.rib_phase * 0.45, seed ^ 0x45u) - 0.13 * (1.0 - at.rib);
    Rgb c = mixed(shell * band, mould * (0.95 + 0.08 * at.rib), at.worn);
    return c + Rgb{1, 1, 0.9} * (26.0 * speck * (0.4 + 0.6 * at.worn));
}

// Thin remains of mother-of-pearl: the colour depends on the layer's thickness, simulated by noise.
Rgb nacre(const Rgb &base, const Probe &at, const Vec3 &p, const Vec3 &n, std::uint32_t seed) {
    const double area =
        gradient_noise(p * 2.9 + Vec3{7, 3, 1}, seed ^ 0x51u) + 0.35 * gradient_noise(p * 13.0, seed ^ 0x52u);
    const double amount = 0.34 * smooth_step(0.16, 0.42, area) * (1.0 - at.worn) * (0.3 + 0.7 * at.rib);
    if (amount <= 0)
        return base;
    const double layer = 0.9 * n.x + 0.7 * n.y + 2.2 * gradient_noise(p * 4.3, seed ^ 0x53u);
    const Rgb film{156 + 40 * sin_turns(layer), 144 + 34 * sin_turns(layer + 0.36), 130 + 38 * sin_turns(layer + 0.68)};
    return mixed(base, film, amount);
}

std::uint8_t to_byte(double x) { return static_cast<std::uint8_t>(std::min(std::max(x, 0.0), 255.0) + 0.5); }

} // namespace

FinishedVertex finish_vertex(const Shell &shell, const Vec3 &position, const Vec3 &normal, double spacing,
                             std::uint32_t seed, std::uint64_t index) {
    const Probe at = shell.probe(position);
    const double line = suture(at, spacing);
    const double lift = relief(at, position, spacing, line, seed);
    const double tint = gradient_noise(position * 11.0, seed ^ 0x42u);
    const bool coiled = at.part == Part::shell || at.part == Part::mould;
    const double open = coiled ? openness(shell, position, normal) + 24.0 * lift : 0.74 + 0.7 * tint + 45.0 * lift;

    Rgb color = stone_color(at, position, tint, seed);
    color = nacre(color, at, position, normal, seed);
    // Fresh breaks and rubbed ribs are pale; dirt stays where nothing rubs.
    color = mixed(color, {186, 166, 134}, 0.55 * at.broken);
    if (coiled)
        color = mixed(color, {203, 178, 138}, 0.40 * smooth_step(0.55, 1.0, at.rib) * smooth_step(0.9, 1.3, open));
    const double dirt = smooth_step(0.92, 0.25, open + 0.5 * tint);
    color = mixed(color, {66, 52, 40}, 0.78 * dirt);
    color = mixed(color, {50, 38, 30}, 0.88 * line);
    color = mixed(color, {48, 40, 34}, 0.75 * at.crack);
    // Pyrite: dark gold grains in a few patches.
    const double pyrite = gradient_noise(position * 3.7, seed ^ 0x61u) - 0.30;
    if (pyrite > 0)
        color = mixed(color, {132, 112, 66},
                      smooth_step(0.22, 0.36, gradient_noise(position * 90.0, seed ^ 0x62u)) *
                          smooth_step(0, 0.12, pyrite) * 0.85);
    const double shade = 1.0 + 0.10 * fractal_noise(position * 39.0, 3, seed ^ 0x63u) +
                         0.055 * (hash_unit(seed + 7u, index) + hash_unit(seed + 8u, index) - 1.0);
    color = color * (shade * mix(0.86, 1.06, clamp01(open)));

    FinishedVertex out;
    out.position = position + normal * (lift + scanner_noise(position, spacing, seed, index));
    const double grain = 5.0 * (hash_unit(seed + 9u, index) - 0.5);
    out.color = {to_byte(color.x + grain), to_byte(color.y), to_byte(color.z - grain)};
    return out;
}

} // namespace pbm::sample
