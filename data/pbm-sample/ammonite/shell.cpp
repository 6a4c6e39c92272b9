#include "shell.h"

#include "pbm-sample/noise/noise.h"

#include <cmath>
#include <optional>

namespace pbm::sample {

namespace {

constexpr double kLnExpansion = 0.620576487725110; // ln 1.86
// Section of the tube, relative to the radius of the whorl.
constexpr double kCentre = 0.735;
constexpr double kHalfHeight = 0.265;
constexpr double kHalfWidth = 0.215;
constexpr double kTaper = 0.16; // makes it narrower towards the venter

constexpr double kRibsPerTurn = 37.0; // primary ribs; each splits in two
constexpr double kRibHeight = 0.021;
constexpr double kKeelHeight = 0.012;
constexpr double kShellThickness = 0.011;
constexpr double kOrnament = 0.06;       // upper bound of the height or depth of all ornament
constexpr double kWallThickness = 0.030; // at the aperture, where the rock in the tube is set back

double radius_at(double turn) { return exp_natural(kLnExpansion * turn); }

// 1 at 0, 0 beyond 1, with slope 0 at both.
double bump(double x) {
    const double t = 1.0 - x * x;
    return t > 0 ? t * t : 0;
}

// Deformation of the shell in the rock.
Vec3 bend(const Vec3 &p) { return {p.x, p.y, p.z + 0.030 * (p.x * p.x - p.y * p.y) + 0.02 * p.x * p.y}; }

// Minimum of two distances, rounded over a width of `k`.
double smooth_min(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0);
    return std::min(a, b) - h * h / (4.0 * k);
}

// Lean of the ribs towards the aperture, in turns; slightly sinuous, as the growing edge of a shell.
double lean(double flank) { return flank * (0.034 * flank - 0.012); }

} // namespace

Shell::Shell(std::uint32_t seed) : seed_(seed) {
    auto random = [seed, n = std::uint64_t{0}](double low, double high) mutable {
        return mix(low, high, hash_unit(seed, ++n));
    };
    // Each crack crosses the last whorl in a plane near the axis.
    constexpr std::array<double, 3> kCrackTurns = {-0.36, -0.60, -0.86};
    for (std::size_t i = 0; i < cracks_.size(); ++i) {
        const double turn = kCrackTurns[i] + random(-0.03, 0.03);
        const double r = radius_at(turn) * 0.8;
        const double angle = turn + kApertureTurn;
        const double tilt = angle + 0.25 + random(-0.09, 0.09);
        Crack &crack = cracks_[i];
        crack.centre = Vec3{r * cos_turns(angle), r * sin_turns(angle), random(-0.1, 0.15)};
        crack.normal = normalized(Vec3{cos_turns(tilt), sin_turns(tilt), random(-0.35, 0.35)});
        crack.offset = dot(crack.normal, crack.centre);
        crack.reach = random(0.32, 0.55);
        crack.width = random(0.007, 0.010);
        crack.slip = i == 1 ? 0.008 : 0;
    }
    for (std::size_t i = 0; i < chips_.size(); ++i) {
        const double turn = random(-0.95, -0.03);
        const double side = random(-0.13, 0.15);
        Chip &chip = chips_[i];
        chip.radius = random(0.04, 0.095);
        const double r = radius_at(turn) * (1.0 - 3.2 * side * side) + chip.radius * 0.74;
        const double angle = turn + kApertureTurn;
        chip.centre = {r * cos_turns(angle), r * sin_turns(angle), side + (side > 0 ? 0.4 : -0.4) * chip.radius};
    }
}

Box Shell::bounds() { return {{-1.15, -1.16, -0.52}, {1.15, 1.15, 0.52}}; }

// Height of the ribs. Towards the venter, one ridge splits into two, a quarter rib to either side.
double Shell::rib_height(double turn, double flank, Probe &out) const {
    double phase = kRibsPerTurn * (turn - lean(flank));
    phase += 0.55 * gradient_noise(phase * 0.37, seed_ ^ 0x51u);
    out.rib_phase = phase;
    const std::int64_t id = floor_to_int(phase);
    const double x = phase - static_cast<double>(id) - 0.5; // -1/2..1/2, 0 on the ridge
    const auto key = static_cast<std::uint64_t>(id);
    const double split_at = 0.50 + 0.12 * hash_unit(seed_ + 1u, key);
    const double split = smooth_step(split_at, split_at + 0.26, flank);
    const double width = mix(0.46, 0.245, split);
    const double ridge = std::max(bump((x - 0.25 * split) / width), bump((x + 0.25 * split) / width));
    const double strength = 0.78 + 0.36 * hash_unit(seed_ + 2u, key);
    const double rise = smooth_step(0.06, 0.24, flank);
    out.rib = ridge * rise;
    const double height = kRibHeight * ridge * strength * rise * mix(1.08, 0.86, split);
    // Constrictions: a pause of growth leaves a furrow along a rib.
    const double pause = fraction(2.3 * (turn - lean(flank)) + 0.2) - 0.5;
    return height - 0.024 * bump(pause / 0.032);
}

// Positive where the shell is worn away: mostly on the chambered part behind the body chamber.
double Shell::wear(double noise, double turn) {
    const double chambered = smooth_step(-0.44, -0.62, turn) - 0.75 * smooth_step(-1.35, -1.9, turn);
    return noise + 0.55 * chambered - 0.28;
}

// The smooth tube at one turn. Its section is between an ellipse and a rounded square: a mean of the 2-norm and the
// 4-norm, divided by its gradient to become a distance.
Shell::Tube Shell::tube_at(const Vec3 &p, double rho, double turn, double radius) {
    Tube tube;
    tube.turn = turn;
    tube.radius = radius;
    const double u = (rho / radius - kCentre) / kHalfHeight;
    const double width = radius * kHalfWidth * (1.0 - kTaper * std::min(std::max(u, -1.3), 1.3));
    const double v = p.z / width;
    const double u2 = u * u;
    const double v2 = v * v;
    const double round = std::sqrt(u2 + v2) + 1e-9;
    const double square = std::sqrt(std::sqrt(u2 * u2 + v2 * v2)) + 1e-9;
    const double square3 = square * square * square;
    tube.norm = 0.62 * round + 0.38 * square;
    const double du = (0.62 * u / round + 0.38 * u2 * u / square3) / (radius * kHalfHeight);
    const double dv = (0.62 * v / round + 0.38 * v2 * v / square3) / width;
    tube.distance = (tube.norm - 1.0) / std::sqrt(du * du + dv * dv + 1e-12);
    tube.flank = 0.5 * (1.0 + u / round);
    tube.across = v;
    const double along = turn > -0.5 ? turn : -kWhorls - turn; // beyond the aperture, or before the first chamber
    tube.bound = std::max(tube.distance, along * kTwoPi * rho);
    return tube;
}

// The tube with its ornament, wear and broken end.
Probe Shell::detail(const Vec3 &p, double rho, const Tube &tube, double wear_noise) const {
    Probe here;
    here.turn = tube.turn;
    here.radius = tube.radius;
    here.flank = tube.flank;
    here.distance = tube.distance;

    double height = rib_height(tube.turn, tube.flank, here);
    const double keel = bump(tube.across / 0.30) * smooth_step(0.80, 0.93, tube.flank);
    height += kKeelHeight * keel * (0.75 + 0.25 * here.rib);
    const double worn = wear(wear_noise, tube.turn);
    here.worn = smooth_step(-0.018, 0.018, worn);
    here.broken = here.worn * (1.0 - smooth_step(0.02, 0.06, worn));
    height = mix(height, 0.86 * height - kShellThickness, here.worn);
    here.distance -= height * tube.radius;
    here.part = here.worn > 0.5 ? Part::mould : Part::shell;

    const double beyond = tube.turn * kTwoPi * rho;
    if (beyond > -0.4) { // a broken aperture; the rock is set back within its rim
        const double ragged = 0.11 * fractal_noise(p * 4.1, 4, seed_ ^ 0xc3u);
        const double rim = beyond + 0.03 + ragged;
        const double fill =
            beyond + 0.11 + 0.35 * ragged + 0.05 * (1.0 - tube.norm) + 0.02 * gradient_noise(p * 19.0, seed_);
        const double inner = std::max(here.distance + kWallThickness * tube.radius, -fill);
        if (rim > here.distance) {
            here.distance = rim;
            here.broken = 1;
        }
        if (-inner > here.distance) {
            here.distance = -inner;
            here.part = fill < 0.02 ? Part::infill : Part::mould;
            here.broken = 0;
        }
    }
    here.distance = std::max(here.distance, (-kWhorls - tube.turn) * kTwoPi * rho);
    return here;
}

void Shell::add_matrix(const Vec3 &p, Probe &nearest) const {
    // Rock on the venter below, and a remnant in the umbilicus on the far side.
    const Vec3 q{(p.x + 0.10) / 0.46, (p.y + 0.93) / 0.21, (p.z - 0.01) / 0.31};
    const Vec3 s{(p.x - 0.17) / 0.23, (p.y + 0.12) / 0.20, (p.z + 0.05) / 0.085};
    double lump = std::min((length(q) - 1.0) * 0.22, (length(s) - 1.0) * 0.08);
    constexpr double kRough = 0.10; // upper bound of what noise subtracts
    if (lump - kRough > std::max(nearest.distance, 0.0)) {
        nearest.distance = std::min(nearest.distance, lump - kRough);
        return;
    }
    lump += 0.085 * fractal_noise(p * 3.3, 3, seed_ ^ 0x3d5u) + 0.014 * gradient_noise(p * 31.0, seed_ ^ 0x77u);
    lump = std::max(lump, -1.05 - p.y + 0.02 * gradient_noise(p * 5.0, seed_ ^ 0x78u));
    if (lump < nearest.distance) {
        nearest.part = Part::matrix;
        nearest.worn = 0;
        nearest.broken = 0;
        nearest.rib = 0;
    }
    nearest.distance = smooth_min(nearest.distance, lump, 0.025);
}

// Signed distance to the wavy face of a crack; large outside of its reach.
double Shell::crack_distance(const Crack &crack, const Vec3 &p) const {
    const double d = dot(crack.normal, p) - crack.offset;
    const Vec3 from_centre = p - crack.centre;
    if (std::abs(d) > 0.09 || dot(from_centre, from_centre) > crack.reach * crack.reach)
        return d > 0 ? 1 : -1;
    return d + 0.055 * fractal_noise(p * 4.7, 4, seed_ + 31u * static_cast<std::uint32_t>(&crack - cracks_.data()));
}

void Shell::add_cracks(const Vec3 &p, Probe &nearest) const {
    for (const Crack &crack : cracks_) {
        const double across = std::abs(crack_distance(crack, p));
        if (across > 2.0 * crack.width)
            continue;
        const double end = length(p - crack.centre) / crack.reach;
        const double width = crack.width * bump(end) * (0.8 + 0.9 * gradient_noise(p * 9.0, seed_ ^ 0x99u));
        if (across >= width)
            continue;
        const double depth = 1.0 - across / width;
        nearest.distance += 1.5 * width * depth;
        nearest.crack = std::max(nearest.crack, depth);
    }
}

void Shell::add_chips(const Vec3 &p, Probe &nearest) const {
    for (const Chip &chip : chips_) {
        const Vec3 d = p - chip.centre;
        const double squared = dot(d, d);
        if (squared > 2.25 * chip.radius * chip.radius)
            continue;
        const double cut = chip.radius - std::sqrt(squared) + 0.022 * fractal_noise(p * 17.0, 3, seed_ ^ 0x1f3u);
        if (cut > nearest.distance) {
            nearest.distance = cut;
            nearest.broken = 1;
            nearest.worn = 1;
            nearest.part = Part::mould;
        }
    }
}

Probe Shell::probe(const Vec3 &position) const {
    Vec3 p = bend(position);
    // One crack is a fault: its far side is shifted.
    const Crack &fault = cracks_[1];
    const double side = crack_distance(fault, p);
    if (side > -0.003)
        p.z += fault.slip * smooth_step(-0.003, 0.003, side) * bump(length(p - fault.centre) / fault.reach);

    const double rho = std::sqrt(p.x * p.x + p.y * p.y) + 1e-9;
    double turn = atan2_turns(p.y, p.x) - kApertureTurn;
    turn -= static_cast<double>(floor_to_int(turn)); // [0, 1): the whorl after the last one
    double radius = radius_at(turn);

    // The first chamber.
    const double first = radius_at(-kWhorls);
    Probe nearest;
    nearest.turn = -kWhorls;
    nearest.radius = first;
    nearest.flank = 0.5;
    nearest.distance = std::sqrt(rho * rho + p.z * p.z) - first;

    std::array<Tube, 8> tubes;
    std::size_t count = 0;
    double bound = nearest.distance;
    for (; turn > -kWhorls - 1.0; turn -= 1.0, radius *= 1.0 / kExpansion) {
        const double u = (rho / radius - kCentre) / kHalfHeight;
        const double aside = (std::abs(u) - 1.3) * kHalfHeight * radius; // lower bound of the distance
        if (aside > std::max(bound, 0.0) || (aside > 0 && turn < -1.0))
            continue;
        tubes[count] = tube_at(p, rho, turn, radius);
        bound = std::min(bound, tubes[count].bound);
        ++count;
    }
    std::optional<double> wear_noise; // shared by all whorls nearby
    for (std::size_t i = 0; i < count; ++i) {
        const Tube &tube = tubes[i];
        const double slack = kOrnament * tube.radius + 0.12 * smooth_step(-0.2, 0.0, tube.turn);
        if (tube.bound > bound + slack || std::abs(tube.bound) > slack) {
            nearest.distance = std::min(nearest.distance, tube.bound);
            continue;
        }
        if (!wear_noise)
            wear_noise = fractal_noise(p * 2.6, 4, seed_ ^ 0xa7u);
        const Probe here = detail(p, rho, tube, *wear_noise);
        if (here.distance < nearest.distance)
            nearest = here;
    }
    add_matrix(p, nearest);
    if (std::abs(nearest.distance) < 0.09) {
        add_chips(p, nearest);
        if (std::abs(nearest.distance) < 0.02)
            add_cracks(p, nearest);
    }
    return nearest;
}

double Shell::outline(const Vec3 &position) const {
    const Vec3 p = bend(position);
    const double rho = std::sqrt(p.x * p.x + p.y * p.y) + 1e-9;
    double turn = atan2_turns(p.y, p.x) - kApertureTurn;
    turn -= static_cast<double>(floor_to_int(turn)) + 1.0;
    double radius = radius_at(turn);
    double distance = std::sqrt(rho * rho + p.z * p.z) - radius_at(-kWhorls);
    Probe unused;
    for (; turn > -kWhorls; turn -= 1.0, radius *= 1.0 / kExpansion) {
        const double u = (rho / radius - kCentre) / kHalfHeight;
        if (std::abs(u) > 1.3 && turn < -1.0)
            continue;
        const Tube tube = tube_at(p, rho, turn, radius);
        double d = tube.distance;
        if (std::abs(d) < kOrnament * radius)
            d -= rib_height(turn, tube.flank, unused) * radius;
        distance = std::min(distance, d);
    }
    return distance;
}

} // namespace pbm::sample
