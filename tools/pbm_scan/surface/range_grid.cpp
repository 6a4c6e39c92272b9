#include "pbm_scan/surface/range_grid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace pbm::build {
namespace {

class RangeGrid {
  public:
    RangeGrid(std::span<const std::uint32_t> cells, std::size_t columns, std::span<const glm::dvec3> positions,
              const glm::dvec3 *scanner)
        : cells_(cells), columns_(columns), positions_(positions), scanner_(scanner) {
        const double row_step = median_step(1), column_step = median_step(columns);
        longest_ = {kLongestGridEdge * row_step, kLongestGridEdge * column_step,
                    kLongestGridEdge * std::sqrt(row_step * row_step + column_step * column_step)};
    }

    std::vector<glm::uvec3> triangles() const {
        std::vector<glm::uvec3> out;
        for (std::size_t cell = 0; cell + columns_ + 1 < cells_.size(); ++cell)
            if ((cell + 1) % columns_ != 0)
                add_cell(cell, out);
        return out;
    }

  private:
    enum Edge : std::uint8_t { along_row, along_column, diagonal };

    // NaN where one of the cells is empty: no comparison with it holds.
    double distance(std::size_t a, std::size_t b) const {
        if (cells_[a] == kEmptyCell || cells_[b] == kEmptyCell)
            return std::numeric_limits<double>::quiet_NaN();
        return glm::distance(positions_[cells_[a]], positions_[cells_[b]]);
    }

    // The same as an angle where the scanner's place is known.
    double step(std::size_t a, std::size_t b) const {
        const double length = distance(a, b);
        if (scanner_ == nullptr || std::isnan(length))
            return length;
        return length / std::min(glm::distance(positions_[cells_[a]], *scanner_),
                                 glm::distance(positions_[cells_[b]], *scanner_));
    }

    double median_step(std::size_t offset) const {
        std::vector<double> steps;
        for (std::size_t cell = 0; cell + offset < cells_.size(); ++cell) {
            const bool wraps = offset == 1 && (cell + 1) % columns_ == 0;
            const double size = wraps ? std::numeric_limits<double>::quiet_NaN() : step(cell, cell + offset);
            if (std::isfinite(size))
                steps.push_back(size);
        }
        if (steps.empty())
            return 0;
        const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
        std::nth_element(steps.begin(), middle, steps.end());
        return *middle;
    }

    bool is_short(std::size_t a, std::size_t b, Edge edge) const { return step(a, b) <= longest_[edge]; }

    // A damaged file may give one vertex to two cells.
    static void add(std::vector<glm::uvec3> &out, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && a != c)
            out.emplace_back(a, b, c);
    }

    // The quad whose lower left cell this is.
    void add_cell(std::size_t cell, std::vector<glm::uvec3> &out) const {
        const std::size_t right = cell + 1, up = cell + columns_, opposite = up + 1;
        const bool bottom = is_short(cell, right, along_row), top = is_short(up, opposite, along_row);
        const bool left = is_short(cell, up, along_column), far = is_short(right, opposite, along_column);
        const double rising = distance(cell, opposite), falling = distance(right, up);
        const bool take_rising = std::isnan(falling) || rising <= falling;
        if (take_rising && is_short(cell, opposite, diagonal)) {
            if (bottom && far)
                add(out, cells_[cell], cells_[right], cells_[opposite]);
            if (left && top)
                add(out, cells_[cell], cells_[opposite], cells_[up]);
        } else if (!take_rising && is_short(right, up, diagonal)) {
            if (bottom && left)
                add(out, cells_[cell], cells_[right], cells_[up]);
            if (far && top)
                add(out, cells_[right], cells_[opposite], cells_[up]);
        }
    }

    std::span<const std::uint32_t> cells_;
    std::size_t columns_;
    std::span<const glm::dvec3> positions_;
    const glm::dvec3 *scanner_; // may be null
    std::array<double, 3> longest_{};
};

} // namespace

std::vector<glm::uvec3> triangulate_range_grid(std::span<const std::uint32_t> cells, std::size_t columns,
                                               std::span<const glm::dvec3> positions, const glm::dvec3 *scanner) {
    assert(columns != 0 && cells.size() % columns == 0);
    return RangeGrid(cells, columns, positions, scanner).triangles();
}

} // namespace pbm::build
