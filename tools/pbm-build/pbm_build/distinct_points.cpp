#include "pbm_build/distinct_points.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr int kCurveBits = 21; // per axis: what a Morton code of 64 bits holds

struct Key {
    MortonCode code;
    std::uint32_t index;
};

MortonCode curve_code(const LatticePoint &p, int lattice_bits) {
    const int shift = std::max(0, lattice_bits - kCurveBits);
    return code_of({p.x >> shift, p.y >> shift, p.z >> shift});
}

} // namespace

DistinctPoints distinct_points(std::span<const glm::dvec3> positions, const Grid &grid, int threads) {
    const std::vector<LatticePoint> lattice = to_lattice(positions, grid, threads);
    std::vector<Key> keys(positions.size());
    for (std::size_t i = 0; i < keys.size(); ++i)
        keys[i] = {curve_code(lattice[i], grid.depth + kLatticeBits), static_cast<std::uint32_t>(i)};
    std::sort(keys.begin(), keys.end(), [&](const Key &a, const Key &b) {
        if (a.code != b.code)
            return a.code < b.code;
        const LatticePoint &at_a = lattice[a.index], &at_b = lattice[b.index];
        if (at_a != at_b)
            return at_a.x != at_b.x ? at_a.x < at_b.x : at_a.y != at_b.y ? at_a.y < at_b.y : at_a.z < at_b.z;
        const glm::dvec3 &p = positions[a.index], &q = positions[b.index];
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
    });
    DistinctPoints distinct;
    distinct.place_of.resize(positions.size());
    std::size_t sharing = 0;
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const std::uint32_t index = keys[i].index;
        sharing = i > 0 && lattice[index] == lattice[keys[i - 1].index] ? sharing : 0;
        const bool repeated = i > 0 && positions[index] == positions[keys[i - 1].index];
        distinct.repeated += repeated ? 1 : 0;
        if (!repeated && sharing < kMostSharing) {
            distinct.at.push_back(lattice[index]);
            ++sharing;
        }
        distinct.place_of[index] = static_cast<std::uint32_t>(distinct.at.size() - 1);
    }
    return distinct;
}

} // namespace pbm::build
