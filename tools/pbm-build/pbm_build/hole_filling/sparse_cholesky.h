// Solves sparse symmetric equations of a surface's vertices.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pbm::build {

// Rows with all of their entries that are not 0, ascending by column, the diagonal included.
struct SymmetricMatrix {
    std::vector<std::int32_t> starts{0}; // fewer than 2^31 entries
    std::vector<std::int32_t> columns;
    std::vector<double> values;

    std::size_t size() const { return starts.size() - 1; }
};

// Three right-hand sides at once. Nothing if the matrix is not positive definite, or the result not finite.
std::optional<std::vector<glm::dvec3>> solve(const SymmetricMatrix &matrix,
                                             std::span<const glm::dvec3> right_hand_sides);

} // namespace pbm::build
