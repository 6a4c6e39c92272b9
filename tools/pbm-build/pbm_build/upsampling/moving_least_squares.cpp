#include "pbm_build/upsampling/moving_least_squares.h"

#include "pbm_build/radii/tangent_cell.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace pbm::build {
namespace {

constexpr std::size_t kTerms = 6, kLinearTerms = 3; // 1, u, v, u^2, uv, v^2

// Added to the squares of the quadratic terms, times the sum of the weights: points on one ring around the place do not
// determine a curvature.
constexpr double kFlatness = 1e-4;
constexpr double kSingular = 1e-9; // minimum pivot, times the sum of the weights

using Terms = std::array<double, kTerms>;

// Solves a x = b for a symmetric, positive definite matrix, of which the lower half is given. False if it is singular.
// Based on: Golub, Van Loan. Matrix Computations. Section 4.1 (square-root free Cholesky)
bool solve(std::array<Terms, kTerms> &a, Terms &x, double least_pivot) {
    for (std::size_t j = 0; j < kTerms; ++j) {
        Terms scaled{};
        double pivot = a[j][j];
        for (std::size_t k = 0; k < j; ++k) {
            scaled[k] = a[j][k] * a[k][k];
            pivot -= a[j][k] * scaled[k];
        }
        if (!(pivot > least_pivot))
            return false;
        a[j][j] = pivot;
        for (std::size_t i = j + 1; i < kTerms; ++i) {
            for (std::size_t k = 0; k < j; ++k)
                a[i][j] -= a[i][k] * scaled[k];
            a[i][j] /= pivot;
        }
    }
    for (std::size_t i = 0; i < kTerms; ++i)
        for (std::size_t k = 0; k < i; ++k)
            x[i] -= a[i][k] * x[k];
    for (std::size_t i = 0; i < kTerms; ++i)
        x[i] /= a[i][i];
    for (std::size_t i = kTerms; i-- > 0;)
        for (std::size_t k = i + 1; k < kTerms; ++k)
            x[i] -= a[k][i] * x[k];
    return true;
}

} // namespace

std::optional<SurfaceFoot> moving_least_squares(std::span<const WeightedPoint> points) {
    glm::dvec3 mean(0);
    double sum = 0;
    for (const WeightedPoint &point : points) {
        mean += point.weight * point.normal;
        sum += point.weight;
    }
    const double length = glm::length(mean);
    if (points.size() < kLinearTerms || !(length > 0))
        return std::nullopt;
    const TangentPlane plane(mean / length);
    std::array<Terms, kTerms> matrix{};
    Terms height{}; // coefficients of the terms
    for (const WeightedPoint &point : points) {
        const glm::dvec2 at = plane.flat(point.offset);
        const double above = plane.height(point.offset);
        const Terms terms{1, at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y};
        for (std::size_t i = 0; i < kTerms; ++i) {
            for (std::size_t j = 0; j <= i; ++j)
                matrix[i][j] += point.weight * (terms[i] * terms[j]);
            height[i] += point.weight * (terms[i] * above);
        }
    }
    for (std::size_t i = kLinearTerms; i < kTerms; ++i)
        matrix[i][i] += kFlatness * sum;
    if (!solve(matrix, height, kSingular * sum))
        return std::nullopt;
    const glm::dvec3 normal = plane.normal - height[1] * plane.right - height[2] * plane.up;
    return SurfaceFoot{height[0] * plane.normal, normal / glm::length(normal)};
}

} // namespace pbm::build
