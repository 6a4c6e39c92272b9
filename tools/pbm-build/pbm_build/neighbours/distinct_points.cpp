#include "pbm_build/neighbours/distinct_points.h"

#include "pbm_build/lattice/lattice_triangle.h"
#include "pbm_build/lattice/radix_sort.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <bit>

namespace pbm::build {
namespace {

constexpr int kCurveBits = 21;  // per axis, in a Morton code of 64 bits
constexpr int kSortedBits = 33; // three digits of a radix sort
constexpr std::size_t kBlock = 65536;

MortonCode curve_code(const LatticePoint &p, int lattice_bits) {
    const int shift = std::max(0, lattice_bits - kCurveBits);
    return code_of({p.x >> shift, p.y >> shift, p.z >> shift});
}

// The positions along the Morton curve, those with equal codes by position. The low bits of each word are an index, of
// as many bits as their number has.
std::vector<std::uint64_t> along_curve(std::span<const glm::dvec3> positions, const Lattice &lattice, int lattice_bits,
                                       int threads) {
    const std::size_t count = positions.size();
    const int index_bits = static_cast<int>(std::bit_width(count)), code_bits = std::min(64 - index_bits, kSortedBits);
    const std::uint64_t index_mask = (std::uint64_t{1} << index_bits) - 1;
    const auto comes_before = [&](std::uint64_t word_a, std::uint64_t word_b) {
        const glm::dvec3 &a = positions[word_a & index_mask], &b = positions[word_b & index_mask];
        const LatticePoint at_a = lattice(a), at_b = lattice(b);
        if (at_a != at_b) {
            const MortonCode code_a = curve_code(at_a, lattice_bits), code_b = curve_code(at_b, lattice_bits);
            if (code_a != code_b)
                return code_a < code_b;
            return before(at_a, at_b);
        }
        return before(a, b);
    };
    // Sorts by the high bits of each code, which distinguish most points, then the rest by comparison.
    const int dropped = std::max(0, 3 * std::min(lattice_bits, kCurveBits) - code_bits);
    std::vector<std::uint64_t> words(count), spare;
    parallel_for(count, kBlock, threads, [&](std::size_t i) {
        words[i] = curve_code(lattice(positions[i]), lattice_bits) >> dropped << index_bits | i;
    });
    radix_sort(words, spare, index_bits, code_bits);
    free_memory(spare);
    for (auto begin = words.begin(), end = begin; begin != words.end(); begin = end) {
        end = std::find_if(begin, words.end(),
                           [&](std::uint64_t word) { return word >> index_bits != *begin >> index_bits; });
        if (end - begin > 1)
            std::sort(begin, end, comes_before);
    }
    return words;
}

} // namespace

DistinctPoints distinct_points(std::span<const glm::dvec3> positions, const Grid &grid, int threads) {
    const Lattice lattice(grid);
    const std::vector<std::uint64_t> words = along_curve(positions, lattice, grid.depth + kLatticeBits, threads);
    const std::uint64_t index_mask = (std::uint64_t{1} << std::bit_width(positions.size())) - 1;
    DistinctPoints distinct;
    distinct.place_of.resize(positions.size());
    distinct.at.reserve(positions.size());
    std::size_t sharing = 0;
    const glm::dvec3 *last = nullptr;
    LatticePoint last_at;
    for (const std::uint64_t word : words) {
        const std::size_t index = word & index_mask;
        const glm::dvec3 &position = positions[index];
        const LatticePoint at = lattice(position);
        sharing = last != nullptr && at == last_at ? sharing : 0;
        const bool repeated = last != nullptr && position == *last;
        distinct.repeated += repeated ? 1 : 0;
        if (!repeated && sharing < kMaxSharing) {
            distinct.at.push_back(at);
            ++sharing;
        }
        distinct.place_of[index] = static_cast<std::uint32_t>(distinct.at.size() - 1);
        last = &position;
        last_at = at;
    }
    return distinct;
}

} // namespace pbm::build
