// Solves sparse symmetric equations of a surface's vertices.
// Based on: Davis. Algorithm 849: A Concise Sparse Cholesky Factorization Package. 2005 (row by row, by the elimination
// tree)
// Based on: George. Nested Dissection of a Regular Finite Element Mesh. 1973 (the order)
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pbm::build {

// Rows with all of their entries that are not 0, ascending by column, the diagonal included.
struct SymmetricMatrix {
    std::vector<std::size_t> starts{0};
    std::vector<std::uint32_t> columns;
    std::vector<double> values;

    std::size_t size() const { return starts.size() - 1; }
};

// Three right-hand sides at once. `places`: of the unknowns in space; neighbours in the matrix should be near each
// other. Nothing if the matrix is not positive definite, or the result not finite.
std::optional<std::vector<glm::dvec3>> solve(const SymmetricMatrix &matrix, std::span<const glm::dvec3> places,
                                             std::span<const glm::dvec3> right_hand_sides);

} // namespace pbm::build
