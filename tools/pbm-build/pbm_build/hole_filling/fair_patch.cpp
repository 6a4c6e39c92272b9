#include "pbm_build/hole_filling/fair_patch.h"

#include "pbm_build/hole_filling/sparse_cholesky.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

// The operator K = -(sum of weights) x U: rows with the sum of weights on the diagonal, and -weight elsewhere.
class Umbrellas {
  public:
    struct Entry {
        std::uint32_t vertex;
        double value;
    };

    explicit Umbrellas(const Patch &patch) : starts_(patch.positions.size() + 1) {
        std::vector<std::array<std::uint32_t, 2>> edges; // both ways, and the vertices themselves
        for (std::uint32_t i = 0; i < patch.positions.size(); ++i)
            edges.push_back({i, i});
        for (const PatchTriangle &t : patch.triangles)
            for (std::size_t side = 0; side < 3; ++side) {
                edges.push_back({t[side], t[(side + 1) % 3]});
                edges.push_back({t[(side + 1) % 3], t[side]});
            }
        std::sort(edges.begin(), edges.end());
        edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
        std::vector<double> sums(patch.positions.size());
        for (const auto &[from, to] : edges) {
            const double weight = from == to ? 0 : edge_weight(patch.positions[from], patch.positions[to]);
            sums[from] += weight;
            entries_.push_back({to, -weight});
            starts_[from + 1] = entries_.size();
        }
        for (std::size_t i = 0; i < entries_.size(); ++i)
            if (entries_[i].vertex == edges[i][0])
                entries_[i].value = sums[edges[i][0]];
    }

    std::span<const Entry> row(std::size_t vertex) const {
        return std::span(entries_).subspan(starts_[vertex], starts_[vertex + 1] - starts_[vertex]);
    }
    double diagonal(std::size_t vertex) const {
        const auto entries = row(vertex);
        return std::find_if(entries.begin(), entries.end(), [&](const Entry &e) { return e.vertex == vertex; })->value;
    }

  private:
    std::vector<std::size_t> starts_; // [vertices + 1]
    std::vector<Entry> entries_;      // ascending in each row
};

// Collects the equations of the new vertices. Vertices of the rim are known: they go to the right-hand side.
class Equations {
  public:
    Equations(std::size_t rim, std::span<const glm::dvec3> known, std::size_t vertices)
        : rim_(rim), known_(known), sums_(vertices) {}

    void add(std::uint32_t vertex, double value) {
        if (vertex < rim_) {
            constant_ -= value * known_[vertex];
            return;
        }
        if (sums_[vertex] == 0)
            columns_.push_back(vertex);
        sums_[vertex] += value;
    }
    void add_constant(const glm::dvec3 &value) { constant_ -= value; }

    void end_row() {
        std::sort(columns_.begin(), columns_.end());
        columns_.erase(std::unique(columns_.begin(), columns_.end()),
                       columns_.end()); // a sum may have been 0 meanwhile
        for (const std::uint32_t column : columns_) {
            matrix_.columns.push_back(static_cast<std::uint32_t>(column - rim_));
            matrix_.values.push_back(sums_[column]);
            sums_[column] = 0;
        }
        columns_.clear();
        matrix_.starts.push_back(matrix_.columns.size());
        right_.push_back(constant_);
        constant_ = glm::dvec3(0);
    }

    // Nothing if rounding was too much for the equations.
    std::optional<std::vector<glm::dvec3>> solution(std::span<const glm::dvec3> places) const {
        return solve(matrix_, places.subspan(rim_), right_);
    }

  private:
    std::size_t rim_;
    std::span<const glm::dvec3> known_;
    SymmetricMatrix matrix_;
    std::vector<glm::dvec3> right_;
    // One row.
    std::vector<double> sums_; // [vertices]
    std::vector<std::uint32_t> columns_;
    glm::dvec3 constant_{0};
};

} // namespace

double edge_weight(const glm::dvec3 &from, const glm::dvec3 &to) {
    constexpr double kShortest = 1e-9; // of a rim that is 1 long
    return 1 / std::max(glm::distance(from, to), kShortest);
}

// The sum of squares of U, weighted by the sums of weights S, is least where K S^-1 K = 0: a symmetric matrix.
void fair_patch(Patch &patch, const Rim &rim) {
    if (patch.positions.size() == patch.rim)
        return;
    const Umbrellas umbrellas(patch);
    Equations equations(patch.rim, patch.positions, patch.positions.size());
    for (std::size_t i = patch.rim; i < patch.positions.size(); ++i) {
        for (const Umbrellas::Entry &entry : umbrellas.row(i)) {
            const std::size_t centre = entry.vertex;
            const bool is_rim = centre < patch.rim;
            const double outside = is_rim ? rim.vertices[centre].outside_weight : 0;
            const double factor = entry.value / (umbrellas.diagonal(centre) + outside);
            for (const Umbrellas::Entry &other : umbrellas.row(centre))
                equations.add(other.vertex, factor * other.value);
            if (is_rim) {
                equations.add(entry.vertex, factor * outside);
                equations.add_constant(-factor * rim.vertices[centre].outside_sum);
            }
        }
        equations.end_row();
    }
    const auto solution = equations.solution(patch.positions);
    if (solution)
        std::copy(solution->begin(), solution->end(), patch.positions.begin() + static_cast<std::ptrdiff_t>(patch.rim));
}

std::vector<glm::dvec3> continue_values(const Patch &patch, std::span<const glm::dvec3> values) {
    std::vector<glm::dvec3> all(values.begin(), values.end());
    if (patch.positions.size() == patch.rim)
        return all;
    const Umbrellas umbrellas(patch);
    Equations equations(patch.rim, values, patch.positions.size());
    for (std::size_t i = patch.rim; i < patch.positions.size(); ++i) {
        for (const Umbrellas::Entry &entry : umbrellas.row(i))
            equations.add(entry.vertex, entry.value);
        equations.end_row();
    }
    const auto solution = equations.solution(patch.positions);
    all.resize(patch.positions.size(), values.front());
    if (solution)
        std::copy(solution->begin(), solution->end(), all.begin() + static_cast<std::ptrdiff_t>(patch.rim));
    return all;
}

} // namespace pbm::build
