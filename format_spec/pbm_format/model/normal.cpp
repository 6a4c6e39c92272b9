#include "pbm_format/model/normal.h"

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
    std::array<UnitVector, kNormalCount> unit;
    std::array<IntegerNormal, kNormalCount> integer;

    NormalTables() { // sets all of them
        for (std::size_t digits = 0; digits < 1024; ++digits) {
            const std::array<int, 3> sum = normal_lattice_sum(static_cast<std::uint16_t>(digits));
            const std::array<double, 3> c{static_cast<double>(sum[0]), static_cast<double>(sum[1]),
                                          static_cast<double>(sum[2])};
            const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double n = c[axis] / length;
                const auto rounded = static_cast<std::int32_t>(n * 32767.0 + 0.5);
                for (std::size_t octant = 0; octant < 8; ++octant) { // they mirror each other
                    const bool negative = (octant >> axis & 1) != 0;
                    unit[octant << 10 | digits][axis] = negative ? -n : n;
                    integer[octant << 10 | digits][axis] = negative ? -rounded : rounded;
                }
            }
        }
    }
};

// On the heap, whose pages may be large: those of static memory are touched one by one. Never deleted, since threads
// may outlive main.
const NormalTables &tables() {
    static const NormalTables &instance = *new NormalTables;
    return instance;
}

// The tables of the unfolded octahedron. BVG.md 5.8.3
struct CellTables {
    std::array<std::uint16_t, kNormalCount> cell_of{};
    std::array<std::uint16_t, kNormalCount> normal_at{};

    CellTables() {
        for (unsigned digits = 0; digits < 1024; ++digits) {
            const auto [x, y, z] = normal_lattice_sum(static_cast<std::uint16_t>(digits));
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

// Number of a triangle of the positive octant. Triangles are in rows, x upwards; the integer parts of a direction's
// coordinates on the octahedron's face, times 32, determine its triangle.
constexpr std::size_t facet_of(int i, int j, int down) {
    const int facet = i * (2 * kCornerScale - i) + 2 * j + down;
    return static_cast<std::size_t>(facet);
}

// A triangle of the positive octant, and the normals that can be nearest to a direction in it. Weights are barycentric,
// one per corner. Scores are linear in them: an order at the corners of a convex region holds inside.
struct Facet {
    float core = 0; // if every weight exceeds this, `own` is the nearest normal
    float side = 1; // else, if two weights exceed this, it is `own` or the neighbour across the third one's edge
    std::uint16_t own = 0;
    std::array<std::uint16_t, 3> across{};
};

// The triangle and all triangles that share a corner with it, ascending. The nearest normal is always among them, which
// the tests verify by brute force.
struct Candidates {
    static constexpr int kMax = 16;
    std::uint16_t count = 0;
    std::array<std::uint16_t, kMax> indices{};
};

class FacetTable {
  public:
    [[gnu::noinline]] FacetTable() {
        std::vector<std::vector<std::uint16_t>> at_corner(static_cast<std::size_t>(2) * kSide * kSide);
        for (int index = 0; index < kNormalCount; ++index)
            for (LatticePoint p : subdivide(index & 1023)) {
                for (std::size_t axis = 0; axis < 3; ++axis)
                    if ((index >> (10 + axis) & 1) != 0)
                        p[axis] = -p[axis];
                at_corner[place(p)].push_back(static_cast<std::uint16_t>(index));
            }
        for (int index = 0; index < 1024; ++index)
            add_triangle(static_cast<std::uint16_t>(index), at_corner);
    }

    const Facet &facet(std::size_t at) const { return facets_[at]; }
    const Candidates &candidates(std::size_t at) const { return candidates_[at]; }

  private:
    static constexpr int kSide = 2 * kCornerScale + 1;
    static constexpr double kSure = 1e-6; // of a score: far above its rounding error

    static std::size_t place(const LatticePoint &p) { // |x| + |y| + |z| is fixed
        const int at = ((p[2] < 0 ? kSide : 0) + p[1] + kCornerScale) * kSide + p[0] + kCornerScale;
        return static_cast<std::size_t>(at);
    }

    void add_triangle(std::uint16_t index, const std::vector<std::vector<std::uint16_t>> &at_corner) {
        const Triangle triangle = subdivide(index);
        const auto low = [&](std::size_t axis) {
            return std::min({triangle[0][axis], triangle[1][axis], triangle[2][axis]});
        };
        const std::size_t at = facet_of(low(0), low(1), kCornerScale - 1 - (low(0) + low(1) + low(2)));
        Facet &facet = facets_[at];
        facet.own = index;
        std::vector<std::uint16_t> near;
        for (const LatticePoint &p : triangle)
            near.insert(near.end(), at_corner[place(p)].begin(), at_corner[place(p)].end());
        std::sort(near.begin(), near.end());
        for (std::size_t k = 0; k + 1 < near.size(); ++k)
            for (std::size_t corner = 0; corner < 3; ++corner)
                if (near[k] == near[k + 1] && near[k] != index && !holds(near[k], triangle[corner], at_corner))
                    facet.across[corner] = near[k];
        near.erase(std::unique(near.begin(), near.end()), near.end());
        candidates_[at].count = static_cast<std::uint16_t>(near.size());
        std::copy(near.begin(), near.end(), candidates_[at].indices.begin());
        find_regions(facet, near, triangle);
    }

    static bool holds(std::uint16_t index, const LatticePoint &corner,
                      const std::vector<std::vector<std::uint16_t>> &at_corner) {
        const auto &there = at_corner[place(corner)];
        return std::find(there.begin(), there.end(), index) != there.end();
    }

    // The score of `one` minus that of `other`, at each corner of a triangle.
    static std::array<double, 3> lead(std::uint16_t one, std::uint16_t other, const Triangle &triangle) {
        const UnitVector &m = tables().unit[one], &n = tables().unit[other];
        std::array<double, 3> by{};
        for (std::size_t corner = 0; corner < 3; ++corner)
            for (std::size_t axis = 0; axis < 3; ++axis)
                by[corner] += triangle[corner][axis] * (m[axis] - n[axis]);
        return by;
    }

    static void find_regions(Facet &facet, std::span<const std::uint16_t> others, const Triangle &triangle) {
        const auto surely_leads = [&](std::uint16_t one, std::uint16_t other,
                                      std::span<const std::array<double, 3>> region) {
            const std::array<double, 3> by = lead(one, other, triangle);
            return std::all_of(region.begin(), region.end(), [&](const std::array<double, 3> &w) {
                return by[0] * w[0] + by[1] * w[1] + by[2] * w[2] > kSure * kCornerScale;
            });
        };
        constexpr double kStep = 1.0 / 256;
        double core = kStep;
        const auto core_is_sure = [&](std::uint16_t other) {
            const double top = 1 - 2 * core;
            const std::array<std::array<double, 3>, 3> region{
                {{top, core, core}, {core, top, core}, {core, core, top}}};
            return other == facet.own || surely_leads(facet.own, other, region);
        };
        // What holds for a region holds for smaller ones, so each normal continues with the previous one's result.
        for (const std::uint16_t other : others)
            while (!core_is_sure(other))
                core += kStep;
        double side = kStep;
        const auto sides_are_sure = [&](std::uint16_t other) {
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const auto weights = [&](double third, double next) {
                    std::array<double, 3> w{};
                    w[corner] = third;
                    w[(corner + 1) % 3] = next;
                    w[(corner + 2) % 3] = 1 - third - next;
                    return w;
                };
                const std::uint16_t across = facet.across[corner];
                const std::array region{weights(0, side), weights(0, 1 - side), weights(core, side),
                                        weights(core, 1 - core - side)};
                if (other != facet.own && other != across && !surely_leads(facet.own, other, region) &&
                    !surely_leads(across, other, region))
                    return false;
            }
            return true;
        };
        for (const std::uint16_t other : others)
            while (2 * side + core < 1 && !sides_are_sure(other))
                side += kStep;
        // The margin exceeds the error of the weights, about 1e-14.
        facet.core = static_cast<float>(core + kStep / 16);
        facet.side = static_cast<float>(2 * side + core < 1 ? side + kStep / 16 : 1);
    }

    std::array<Facet, 1024> facets_{};
    std::array<Candidates, 1024> candidates_{};
};

const FacetTable &facet_table() {
    static const FacetTable instance;
    return instance;
}

// The position of a direction on the face of the positive octant.
struct FacetPosition {
    std::size_t facet;
    std::array<double, 3> weights; // of the facet's corners
};

// Requires a + b + c = 32, up to rounding.
FacetPosition position_on_face(double a, double b, double c) {
    const int i = static_cast<int>(a), j = static_cast<int>(b), k = static_cast<int>(c);
    const int down = kCornerScale - 1 - (i + j + k);
    if (down == 0 || down == 1)
        return {facet_of(i, j, down),
                {std::fabs(down - (a - i)), std::fabs(down - (b - j)), std::fabs(down - (c - k))}};
    // A corner of triangles, up to rounding. Any of its triangles will do: all others are among the candidates.
    if (down < 0)
        return {i > 0 ? facet_of(i - 1, j, 0) : j > 0 ? facet_of(i, j - 1, 0) : facet_of(i, j, 0), {}};
    return {facet_of(i + 1, j, 1), {}};
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
    const double a = std::fabs(x), b = std::fabs(y), c = std::fabs(z), sum = a + b + c;
    if (!(sum / 2 > 0))
        return 0;
    const unsigned octant = (x < 0 ? 1U : 0U) | (y < 0 ? 2U : 0U) | (z < 0 ? 4U : 0U);
    // Mirroring a normal changes its octant bits only.
    const auto mirrored = [&](std::uint16_t index) { return static_cast<std::uint16_t>(index ^ octant << 10); };
    const double scale = kCornerScale / sum;
    const FacetPosition place =
        scale < HUGE_VAL ? position_on_face(a * scale, b * scale, c * scale)
                         : position_on_face(a / sum * kCornerScale, b / sum * kCornerScale, c / sum * kCornerScale);
    const FacetTable &table = facet_table();
    const UnitVector *const units = tables().unit.data();
    const Facet &facet = table.facet(place.facet);
    const auto score = [&](std::uint16_t index) {
        const UnitVector &n = units[index];
        return (x * n[0] + y * n[1]) + z * n[2];
    };
    // Avoid branches: successive directions would take them in turn and mispredict.
    const auto &[u, v, w] = place.weights;
    const double min_of_two = std::min(u, v), least = std::min(min_of_two, w);
    const double middle = std::max(min_of_two, std::min(std::max(u, v), w));
    if (std::max(least - facet.core, middle - facet.side) > 0) {
        std::size_t third = v < u ? 1 : 0;
        third = w < min_of_two ? 2 : third;
        const std::uint16_t own = mirrored(facet.own), across = mirrored(facet.across[third]);
        const double lead = score(across) - score(own);
        return (static_cast<unsigned>(lead > 0) |
                (static_cast<unsigned>(lead == 0) & static_cast<unsigned>(across < own))) != 0
                   ? across
                   : own;
    }
    std::uint16_t best = 0;
    double best_score = -HUGE_VAL;
    const Candidates &near = table.candidates(place.facet);
    for (std::size_t k = 0; k < near.count; ++k) {
        const std::uint16_t index = mirrored(near.indices[k]);
        const double index_score = score(index);
        if (index_score > best_score || (index_score == best_score && index < best)) {
            best_score = index_score;
            best = index;
        }
    }
    return best;
}

} // namespace pbm
