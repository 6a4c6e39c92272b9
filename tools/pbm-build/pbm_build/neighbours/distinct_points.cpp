#include "pbm_build/neighbours/distinct_points.h"

#include "pbm_build/grid/lattice_triangle.h"
#include "pbm_build/grid/radix_sort.h"

#include <algorithm>
#include <bit>

namespace pbm::build {
namespace {

constexpr int kCurveBits = 21;  // per axis, in a Morton code of 64 bits
constexpr int kSortedBits = 33; // three digits of a radix sort

MortonCode curve_code(const LatticePoint &p, int lattice_bits) {
    const int shift = std::max(0, lattice_bits - kCurveBits);
    return code_of({p.x >> shift, p.y >> shift, p.z >> shift});
}

// Indices of the points along the Morton curve, points with equal codes by position.
std::vector<std::uint32_t> curve_order(std::span<const glm::dvec3> positions, std::span<const LatticePoint> lattice,
                                       int lattice_bits) {
    const auto comes_before = [&](std::uint32_t a, std::uint32_t b) {
        const LatticePoint &at_a = lattice[a], &at_b = lattice[b];
        if (at_a != at_b) {
            const MortonCode code_a = curve_code(at_a, lattice_bits), code_b = curve_code(at_b, lattice_bits);
            if (code_a != code_b)
                return code_a < code_b;
            return before(at_a, at_b);
        }
        return before(positions[a], positions[b]);
    };
    // Sorts by the high bits of each code, which distinguish most points, then the rest by comparison.
    const std::size_t count = positions.size();
    const int index_bits = static_cast<int>(std::bit_width(count)), code_bits = std::min(64 - index_bits, kSortedBits);
    const int dropped = std::max(0, 3 * std::min(lattice_bits, kCurveBits) - code_bits);
    std::vector<std::uint64_t> words(count), spare;
    for (std::size_t i = 0; i < count; ++i)
        words[i] = curve_code(lattice[i], lattice_bits) >> dropped << index_bits | i;
    radix_sort(words, spare, index_bits, code_bits);
    std::vector<std::uint32_t> order(count);
    for (std::size_t i = 0; i < count; ++i)
        order[i] = static_cast<std::uint32_t>(words[i] & ((std::uint64_t{1} << index_bits) - 1));
    for (std::size_t begin = 0, end = 0; begin < count; begin = end) {
        for (end = begin + 1; end < count && words[end] >> index_bits == words[begin] >> index_bits;)
            ++end;
        if (end - begin > 1)
            std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin),
                      order.begin() + static_cast<std::ptrdiff_t>(end), comes_before);
    }
    return order;
}

} // namespace

DistinctPoints distinct_points(std::span<const glm::dvec3> positions, const Grid &grid, int threads) {
    const std::vector<LatticePoint> lattice = to_lattice(positions, grid, threads);
    const std::vector<std::uint32_t> order = curve_order(positions, lattice, grid.depth + kLatticeBits);
    DistinctPoints distinct;
    distinct.place_of.resize(positions.size());
    distinct.at.reserve(positions.size());
    std::size_t sharing = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::uint32_t index = order[i];
        sharing = i > 0 && lattice[index] == lattice[order[i - 1]] ? sharing : 0;
        const bool repeated = i > 0 && positions[index] == positions[order[i - 1]];
        distinct.repeated += repeated ? 1 : 0;
        if (!repeated && sharing < kMaxSharing) {
            distinct.at.push_back(lattice[index]);
            ++sharing;
        }
        distinct.place_of[index] = static_cast<std::uint32_t>(distinct.at.size() - 1);
    }
    return distinct;
}

} // namespace pbm::build
