#include "pbm_format/normal.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pbm {

namespace {

constexpr int kDigits = 5;
constexpr int kCornerScale =
    32; // corners of the octahedron lie at 32 = 2^kDigits, so that every midpoint is an integer

using LatticePoint = std::array<int, 3>;      // on |x| + |y| + |z| = 32
using Triangle = std::array<LatticePoint, 3>; // x corner, y corner, z corner

LatticePoint midpoint(const LatticePoint &a, const LatticePoint &b) {
    return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

// Triangle of the octant with all signs positive. BVG.md 6.1.2
Triangle subdivide(int digits) {
    Triangle t{LatticePoint{kCornerScale, 0, 0}, LatticePoint{0, kCornerScale, 0}, LatticePoint{0, 0, kCornerScale}};
    for (int level = kDigits - 1; level >= 0; --level) {
        const LatticePoint yz = midpoint(t[1], t[2]), zx = midpoint(t[2], t[0]), xy = midpoint(t[0], t[1]);
        switch (digits >> 2 * level & 3) {
        case 0: t = {yz, zx, xy}; break;
        case 1: t = {t[0], xy, zx}; break;
        case 2: t = {xy, t[1], yz}; break;
        default: t = {zx, yz, t[2]}; break;
        }
    }
    return t;
}

struct NormalTables {
    std::array<UnitVector, kNormalCount> unit{};
    std::array<IntegerNormal, kNormalCount> integer{};

    NormalTables() {
        for (int index = 0; index < kNormalCount; ++index) {
            const std::array<int, 3> sum = normal_lattice_sum(static_cast<std::uint16_t>(index));
            const std::array<double, 3> c{static_cast<double>(sum[0]), static_cast<double>(sum[1]),
                                          static_cast<double>(sum[2])};
            const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double n = c[axis] / length;
                const double scaled = n * 32767.0;
                unit[static_cast<std::size_t>(index)][axis] = n;
                integer[static_cast<std::size_t>(index)][axis] =
                    static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
            }
        }
    }
};

const NormalTables &tables() {
    static const NormalTables instance;
    return instance;
}

struct CellTables {
    std::array<std::uint16_t, kNormalCount> cell_of{};
    std::array<std::uint16_t, kNormalCount> normal_at{};

    CellTables() {
        for (unsigned digits = 0; digits < 1024; ++digits) {
            const Triangle t = subdivide(static_cast<int>(digits));
            const int x = t[0][0] + t[1][0] + t[2][0], y = t[0][1] + t[1][1] + t[2][1];
            for (unsigned octant = 0; octant < 8; ++octant) {
                const bool down = (octant & 4) != 0;
                const int a = down ? 3 * kCornerScale - y : x, b = down ? 3 * kCornerScale - x : y;
                const int u = 2 * (a / 3) + a % 3 - 1, v = b / 3;
                const int cell = ((octant & 1) != 0 ? 63 - u : 64 + u) + 128 * ((octant & 2) != 0 ? 31 - v : 32 + v);
                const unsigned index = octant << 10 | digits;
                cell_of[index] = static_cast<std::uint16_t>(cell);
                normal_at[static_cast<std::size_t>(cell)] = static_cast<std::uint16_t>(index);
            }
        }
    }
};

const CellTables &cell_tables() {
    static const CellTables instance;
    return instance;
}

// For each triangle of the positive octant: itself and all triangles that share a corner with it, ascending. The
// nearest normal of a direction is always among those of the triangle that holds it (the tests prove it by brute
// force).
struct CandidateTable {
    static constexpr int kMost = 16;
    std::array<std::array<std::uint16_t, kMost>, 1024> candidates{};
    std::array<std::uint8_t, 1024> count{};

    CandidateTable() {
        constexpr int kSide = 2 * kCornerScale + 1;
        std::vector<std::vector<std::uint16_t>> at_corner(static_cast<std::size_t>(kSide) * kSide * kSide);
        const auto place = [](const LatticePoint &p) {
            return (static_cast<std::size_t>(p[2] + kCornerScale) * kSide +
                    static_cast<std::size_t>(p[1] + kCornerScale)) *
                       kSide +
                   static_cast<std::size_t>(p[0] + kCornerScale);
        };
        for (int index = 0; index < kNormalCount; ++index)
            for (LatticePoint p : subdivide(index & 1023)) {
                for (std::size_t axis = 0; axis < 3; ++axis)
                    if ((index >> (10 + axis) & 1) != 0)
                        p[axis] = -p[axis];
                at_corner[place(p)].push_back(static_cast<std::uint16_t>(index));
            }
        for (int index = 0; index < 1024; ++index) {
            std::vector<std::uint16_t> near;
            for (const LatticePoint &p : subdivide(index))
                near.insert(near.end(), at_corner[place(p)].begin(), at_corner[place(p)].end());
            std::sort(near.begin(), near.end());
            near.erase(std::unique(near.begin(), near.end()), near.end());
            const auto i = static_cast<std::size_t>(index);
            count[i] = static_cast<std::uint8_t>(near.size());
            std::copy(near.begin(), near.end(), candidates[i].begin());
        }
    }
};

const CandidateTable &candidate_table() {
    static const CandidateTable instance;
    return instance;
}

} // namespace

std::array<int, 3> normal_lattice_sum(std::uint16_t index) {
    const Triangle t = subdivide(index & 1023);
    std::array<int, 3> c{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int sum = t[0][axis] + t[1][axis] + t[2][axis];
        c[axis] = (index >> (10 + axis) & 1) != 0 ? -sum : sum;
    }
    return c;
}

std::span<const UnitVector> normal_table() { return tables().unit; }
std::span<const IntegerNormal> integer_normal_table() { return tables().integer; }

std::span<const std::uint16_t> normal_cells() { return cell_tables().cell_of; }
std::span<const std::uint16_t> normals_of_cells() { return cell_tables().normal_at; }

std::uint16_t quantise_normal(double x, double y, double z) {
    const unsigned octant = (x < 0 ? 1U : 0U) | (y < 0 ? 2U : 0U) | (z < 0 ? 4U : 0U);
    double a = std::fabs(x), b = std::fabs(y), c = std::fabs(z);
    double half = (a + b + c) / 2;
    if (!(half > 0))
        return 0;
    // Descend in barycentric coordinates of the octahedron's face.
    unsigned digits = 0;
    for (int level = 0; level < kDigits; ++level) {
        digits <<= 2;
        if (a > half) {
            digits |= 1;
            a -= half;
        } else if (b > half) {
            digits |= 2;
            b -= half;
        } else if (c > half) {
            digits |= 3;
            c -= half;
        } else {
            a = half - a;
            b = half - b;
            c = half - c;
        }
        half /= 2;
    }
    const auto &unit = tables().unit;
    const CandidateTable &near = candidate_table();
    std::uint16_t best = 0;
    double best_score = -HUGE_VAL;
    for (std::size_t k = 0; k < near.count[digits]; ++k) {
        // Candidates were listed for the positive octant; mirroring a triangle flips its octant bits only.
        const auto index = static_cast<std::uint16_t>(near.candidates[digits][k] ^ octant << 10);
        const UnitVector &n = unit[index];
        const double score = (x * n[0] + y * n[1]) + z * n[2];
        if (score > best_score || (score == best_score && index < best)) {
            best_score = score;
            best = index;
        }
    }
    return best;
}

} // namespace pbm
