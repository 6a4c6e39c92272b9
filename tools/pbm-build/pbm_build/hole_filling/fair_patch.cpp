#include "pbm_build/hole_filling/fair_patch.h"

#include "pbm_build/hole_filling/sparse_cholesky.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace pbm::build {
namespace {

// Area x L: rows with the sum of weights on the diagonal, and -weight elsewhere.
class Laplacian {
  public:
    struct Entry {
        std::uint32_t vertex;
        double value;
    };

    explicit Laplacian(const Patch &patch) : starts_(patch.positions.size() + 1), areas_(patch.positions.size()) {
        struct Weight {
            std::uint32_t from, to;
            double value;
        };
        std::vector<Weight> weights; // both ways, one for each face; 0 for the diagonal
        for (std::uint32_t i = 0; i < patch.positions.size(); ++i)
            weights.push_back({i, i, 0});
        for (const PatchTriangle &t : patch.triangles)
            for (std::size_t side = 0; side < 3; ++side) {
                const std::uint32_t from = t[side], to = t[(side + 1) % 3], apex = t[(side + 2) % 3];
                const glm::dvec3 &a = patch.positions[from], &b = patch.positions[to], &c = patch.positions[apex];
                const double cotangent = cotangent_at(c, a, b);
                weights.push_back({from, to, cotangent});
                weights.push_back({to, from, cotangent});
                areas_[apex] += glm::length(glm::cross(a - c, b - c)) / 6;
            }
        std::sort(weights.begin(), weights.end(), [](const Weight &a, const Weight &b) {
            return std::tie(a.from, a.to, a.value) < std::tie(b.from, b.to, b.value);
        });
        for (std::size_t i = 0; i < weights.size();) {
            const auto [from, to, first] = weights[i];
            double weight = 0;
            for (; i < weights.size() && weights[i].from == from && weights[i].to == to; ++i)
                weight += weights[i].value;
            if (from != to && std::max(from, to) >= patch.rim)
                weight = std::max(weight, kMinWeight); // else values could lie beyond those around
            entries_.push_back({to, -weight});
            starts_[from + 1] = entries_.size();
        }
        for (std::size_t i = 0; i + 1 < starts_.size(); ++i)
            set_diagonal(i);
    }

    std::span<const Entry> row(std::size_t vertex) const {
        return std::span(entries_).subspan(starts_[vertex], starts_[vertex + 1] - starts_[vertex]);
    }
    double area(std::size_t vertex) const { return areas_[vertex]; }

  private:
    static constexpr double kMinWeight = 0.01;

    void set_diagonal(std::size_t vertex) {
        double sum = 0;
        for (const Entry &entry : row(vertex))
            sum -= entry.value;
        for (std::size_t i = starts_[vertex]; i < starts_[vertex + 1]; ++i)
            if (entries_[i].vertex == vertex)
                entries_[i].value = sum;
    }

    std::vector<std::size_t> starts_; // [vertices + 1]
    std::vector<Entry> entries_;      // ascending in each row
    std::vector<double> areas_;       // [vertices] a third of the patch's faces
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
            matrix_.columns.push_back(static_cast<std::int32_t>(column - rim_));
            matrix_.values.push_back(sums_[column]);
            sums_[column] = 0;
        }
        columns_.clear();
        matrix_.starts.push_back(static_cast<std::int32_t>(matrix_.columns.size()));
        right_.push_back(constant_);
        constant_ = glm::dvec3(0);
    }

    // Nothing if rounding was too much for the equations.
    std::optional<std::vector<glm::dvec3>> solution() const { return solve(matrix_, right_); }

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

double cotangent_at(const glm::dvec3 &apex, const glm::dvec3 &from, const glm::dvec3 &to) {
    constexpr double kLargest = 20;
    const glm::dvec3 a = from - apex, b = to - apex;
    const double sine = glm::length(glm::cross(a, b)), cosine = glm::dot(a, b);
    return std::fabs(cosine) < kLargest * sine ? cosine / sine : std::copysign(kLargest, cosine);
}

// With K = area x L and M = the areas: the integral of L^2 is least where K M^-1 K = 0, a symmetric matrix.
void fair_patch(Patch &patch, const Rim &rim) {
    if (patch.positions.size() == patch.rim)
        return;
    const Laplacian laplacian(patch);
    Equations equations(patch.rim, patch.positions, patch.positions.size());
    constexpr double kMinArea = 1e-9; // of a rim that is 1 long
    for (std::size_t i = patch.rim; i < patch.positions.size(); ++i) {
        for (const Laplacian::Entry &entry : laplacian.row(i)) {
            const std::size_t centre = entry.vertex;
            const bool is_rim = centre < patch.rim;
            const double area = laplacian.area(centre) + (is_rim ? rim.vertices[centre].outside_area : 0);
            const double factor = entry.value / std::max(area, kMinArea);
            for (const Laplacian::Entry &other : laplacian.row(centre))
                equations.add(other.vertex, factor * other.value);
            if (is_rim) {
                equations.add(entry.vertex, factor * rim.vertices[centre].outside_weight);
                equations.add_constant(-factor * rim.vertices[centre].outside_sum);
            }
        }
        equations.end_row();
    }
    const auto solution = equations.solution();
    if (solution)
        std::copy(solution->begin(), solution->end(), patch.positions.begin() + static_cast<std::ptrdiff_t>(patch.rim));
}

std::vector<glm::dvec3> continue_values(const Patch &patch, std::span<const glm::dvec3> values) {
    std::vector<glm::dvec3> all(values.begin(), values.end());
    if (patch.positions.size() == patch.rim)
        return all;
    const Laplacian laplacian(patch);
    Equations equations(patch.rim, values, patch.positions.size());
    for (std::size_t i = patch.rim; i < patch.positions.size(); ++i) {
        for (const Laplacian::Entry &entry : laplacian.row(i))
            equations.add(entry.vertex, entry.value);
        equations.end_row();
    }
    const auto solution = equations.solution();
    all.resize(patch.positions.size(), values.front());
    if (solution)
        std::copy(solution->begin(), solution->end(), all.begin() + static_cast<std::ptrdiff_t>(patch.rim));
    return all;
}

} // namespace pbm::build
