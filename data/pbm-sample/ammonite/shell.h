// The shape of a fossil ammonite: a ribbed tube, coiled in a logarithmic spiral, with damage.
// Based on: Raup. Geometric Analysis of Shell Coiling: General Problems. 1966 (whorl expansion, section, umbilicus)
//
// Shell space: the coil lies in the xy plane around the origin and grows counter-clockwise seen from +z; the radius of
// the last whorl at the aperture is 1. Position along the coil is counted in turns: 0 at the aperture, negative
// inwards.
#pragma once

#include "isosurface.h"
#include "pbm-sample/noise/deterministic_math.h"

#include <array>
#include <cstdint>

namespace pbm::sample {

constexpr double kExpansion = 1.86;    // radius ratio of neighbouring whorls
constexpr double kWhorls = 5.7;        // turns from the first chamber to the aperture
constexpr double kApertureTurn = 0.06; // direction of the aperture, from +x
constexpr double kSeptaPerTurn = 15.0;

enum class Part { shell, mould, infill, matrix };

// Properties of the surface nearest to a point of shell space. Lengths in shell units.
struct Probe {
    double distance = 0; // negative inside
    Part part = Part::shell;
    double turn = 0;      // along the coil
    double flank = 0;     // across it: 0 at the inner side of the tube, 1 at the venter
    double radius = 1;    // of the whorl at this turn; details scale with it
    double rib = 0;       // 0 in a groove .. 1 on a rib
    double rib_phase = 0; // integers between ribs
    double worn = 0;      // 0: shell preserved, 1: worn away to the internal mould
    double crack = 0;     // 0..1 at the bottom of a crack
    double broken = 0;    // 0..1 on fresh break surfaces
};

// A shell grown from `seed`: the proportions are fixed, the damage varies.
class Shell {
  public:
    explicit Shell(std::uint32_t seed);

    Probe probe(const Vec3 &p) const;

    // Distance to the coil with its ribs, without damage and rock: a cheaper part of `probe`.
    double outline(const Vec3 &p) const;

    // A box around the whole surface.
    static Box bounds();

  private:
    struct Crack {
        Vec3 normal;
        double offset = 0;
        Vec3 centre; // of the cracked stretch
        double reach = 0;
        double width = 0;
        double slip = 0; // of the far side along z
    };
    struct Chip {
        Vec3 centre;
        double radius = 0;
    };

    struct Tube {
        double turn = 0;
        double radius = 1;
        double norm = 0; // 1 on the surface of the section
        double distance = 0;
        double bound = 0; // bound of the distance, including the cut ends
        double flank = 0;
        double across = 0;
    };

    static Tube tube_at(const Vec3 &p, double rho, double turn, double radius);
    Probe detail(const Vec3 &p, double rho, const Tube &tube, double wear_noise) const;
    double rib_height(double turn, double flank, Probe &out) const;
    static double wear(double noise, double turn);
    double crack_distance(const Crack &crack, const Vec3 &p) const;
    void add_matrix(const Vec3 &p, Probe &nearest) const;
    void add_cracks(const Vec3 &p, Probe &nearest) const;
    void add_chips(const Vec3 &p, Probe &nearest) const;

    std::uint32_t seed_;
    std::array<Crack, 3> cracks_;
    std::array<Chip, 9> chips_;
};

} // namespace pbm::sample
