#include "pbm_build/hole_filling/sparse_cholesky.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace pbm::build {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

int longest_axis(std::span<const std::uint32_t> vertices, std::span<const glm::dvec3> places) {
    glm::dvec3 low = places[vertices[0]], high = low;
    for (const std::uint32_t vertex : vertices) {
        low = glm::min(low, places[vertex]);
        high = glm::max(high, places[vertex]);
    }
    const glm::dvec3 extent = high - low;
    const int axis = extent.y > extent.x ? 1 : 0;
    return extent.z > extent[axis] ? 2 : axis;
}

// The order of elimination. Halves sets of unknowns in space; those of the lower half that have a neighbour in the
// upper one come last.
std::vector<std::uint32_t> dissect(const SymmetricMatrix &matrix, std::span<const glm::dvec3> places) {
    constexpr std::size_t kSmall = 32;
    std::vector<std::uint32_t> order(matrix.size());
    for (std::uint32_t i = 0; i < order.size(); ++i)
        order[i] = i;
    std::vector<std::uint32_t> upper_half_of(matrix.size(), kNone); // which of the sets
    std::vector<std::array<std::size_t, 2>> open{{0, order.size()}};
    for (std::uint32_t set = 0; !open.empty(); ++set) {
        const auto [begin, end] = open.back();
        open.pop_back();
        if (end - begin <= kSmall)
            continue;
        const std::span<std::uint32_t> all = std::span(order).subspan(begin, end - begin);
        const int axis = longest_axis(all, places);
        std::sort(all.begin(), all.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(places[a][axis], a) < std::pair(places[b][axis], b);
        });
        const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
        for (auto at = middle; at != all.end(); ++at)
            upper_half_of[*at] = set;
        const auto border = std::stable_partition(all.begin(), middle, [&](std::uint32_t i) {
            const auto first = matrix.columns.begin();
            return std::none_of(first + static_cast<std::ptrdiff_t>(matrix.starts[i]),
                                first + static_cast<std::ptrdiff_t>(matrix.starts[i + 1]),
                                [&](std::uint32_t column) { return upper_half_of[column] == set; });
        });
        const std::size_t lower = begin + static_cast<std::size_t>(border - all.begin());
        const auto last = std::rotate(border, middle, all.end());
        open.push_back({begin, lower});
        open.push_back({lower, begin + static_cast<std::size_t>(last - all.begin())});
    }
    return order;
}

// matrix = L D L^T, with the unknowns in the order of elimination.
class Factors {
  public:
    Factors(const SymmetricMatrix &matrix, std::span<const std::uint32_t> order)
        : matrix_(matrix), order_(order), place_of_(order.size()), parents_(order.size(), kNone) {
        for (std::uint32_t i = 0; i < order.size(); ++i)
            place_of_[order[i]] = i;
        count_entries();
    }

    // False if the matrix is not positive definite.
    bool factor() {
        const std::size_t size = order_.size();
        rows_.resize(starts_.back());
        values_.resize(starts_.back());
        diagonal_.resize(size);
        std::vector<std::size_t> ends(starts_.begin(), starts_.end() - 1);
        std::vector<double> row(size);
        std::vector<std::uint32_t> seen(size, kNone), pattern, path;
        for (std::uint32_t k = 0; k < size; ++k) {
            pattern.clear(); // of row k of L, columns after those that depend on them
            for_lower_entries(k, [&](std::uint32_t column, double value) {
                row[column] = value;
                path.clear();
                for (std::uint32_t i = column; i != k && seen[i] != k; i = parents_[i]) {
                    seen[i] = k;
                    path.push_back(i);
                }
                pattern.insert(pattern.end(), path.rbegin(), path.rend());
            });
            double diagonal = std::exchange(row[k], 0);
            for (auto at = pattern.rbegin(); at != pattern.rend(); ++at) {
                const std::uint32_t column = *at;
                const double value = std::exchange(row[column], 0);
                for (std::size_t i = starts_[column]; i < ends[column]; ++i)
                    row[rows_[i]] -= values_[i] * value;
                const double entry = value / diagonal_[column];
                diagonal -= entry * value;
                rows_[ends[column]] = k;
                values_[ends[column]++] = entry;
            }
            if (!(diagonal > 0))
                return false;
            diagonal_[k] = diagonal;
        }
        return true;
    }

    std::vector<glm::dvec3> solve(std::span<const glm::dvec3> right_hand_sides) const {
        const std::size_t size = order_.size();
        std::vector<glm::dvec3> x(size), result(size);
        for (std::size_t i = 0; i < size; ++i)
            x[i] = right_hand_sides[order_[i]];
        for (std::size_t column = 0; column < size; ++column)
            for (std::size_t i = starts_[column]; i < starts_[column + 1]; ++i)
                x[rows_[i]] -= values_[i] * x[column];
        for (std::size_t column = size; column-- > 0;) {
            x[column] /= diagonal_[column];
            for (std::size_t i = starts_[column]; i < starts_[column + 1]; ++i)
                x[column] -= values_[i] * x[rows_[i]];
        }
        for (std::size_t i = 0; i < size; ++i)
            result[order_[i]] = x[i];
        return result;
    }

  private:
    // Entries of row k up to the diagonal.
    template <class Use> void for_lower_entries(std::uint32_t k, const Use &use) const {
        const std::uint32_t row = order_[k];
        for (std::size_t i = matrix_.starts[row]; i < matrix_.starts[row + 1]; ++i)
            if (const std::uint32_t column = place_of_[matrix_.columns[i]]; column <= k)
                use(column, matrix_.values[i]);
    }

    // The elimination tree, and where each column of L starts.
    void count_entries() {
        std::vector<std::uint32_t> seen(order_.size(), kNone);
        starts_.assign(order_.size() + 1, 0);
        for (std::uint32_t k = 0; k < order_.size(); ++k) {
            seen[k] = k;
            for_lower_entries(k, [&](std::uint32_t column, double) {
                for (std::uint32_t i = column; seen[i] != k; i = parents_[i]) {
                    if (parents_[i] == kNone)
                        parents_[i] = k;
                    ++starts_[i + 1];
                    seen[i] = k;
                }
            });
        }
        for (std::size_t i = 1; i < starts_.size(); ++i)
            starts_[i] += starts_[i - 1];
    }

    const SymmetricMatrix &matrix_;
    std::span<const std::uint32_t> order_;
    std::vector<std::uint32_t> place_of_, parents_; // places in the order
    std::vector<std::size_t> starts_;               // of the columns of L, without the diagonal
    std::vector<std::uint32_t> rows_;
    std::vector<double> values_, diagonal_;
};

} // namespace

std::optional<std::vector<glm::dvec3>> solve(const SymmetricMatrix &matrix, std::span<const glm::dvec3> places,
                                             std::span<const glm::dvec3> right_hand_sides) {
    const std::vector<std::uint32_t> order = dissect(matrix, places);
    Factors factors(matrix, order);
    if (!factors.factor())
        return std::nullopt;
    std::vector<glm::dvec3> solution = factors.solve(right_hand_sides);
    for (const glm::dvec3 &value : solution)
        if (!((value.x - value.x) + (value.y - value.y) + (value.z - value.z) == 0.0))
            return std::nullopt;
    return solution;
}

} // namespace pbm::build
