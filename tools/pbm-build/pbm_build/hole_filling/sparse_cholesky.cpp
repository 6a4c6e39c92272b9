#include "pbm_build/hole_filling/sparse_cholesky.h"

#include <Eigen/SparseCholesky>

namespace pbm::build {

std::optional<std::vector<glm::dvec3>> solve(const SymmetricMatrix &matrix,
                                             std::span<const glm::dvec3> right_hand_sides) {
    const auto size = static_cast<Eigen::Index>(matrix.size());
    const Eigen::Map<const Eigen::SparseMatrix<double>> columns(
        size, size, static_cast<Eigen::Index>(matrix.values.size()), matrix.starts.data(), matrix.columns.data(),
        matrix.values.data()); // rows, but it is symmetric
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(columns);
    if (factors.info() != Eigen::Success || !(factors.vectorD().array() > 0).all())
        return std::nullopt;
    using Vectors = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
    const Vectors solution = factors.solve(Vectors(Eigen::Map<const Vectors>(&right_hand_sides.front().x, size, 3)));
    if (!solution.allFinite())
        return std::nullopt;
    std::vector<glm::dvec3> result(matrix.size());
    Eigen::Map<Vectors>(&result.front().x, size, 3) = solution;
    return result;
}

} // namespace pbm::build
