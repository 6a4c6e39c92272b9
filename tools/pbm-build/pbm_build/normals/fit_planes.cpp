#include "pbm_build/normals/fit_planes.h"

#include "system/threads/parallel.h"

#include <glm/vec2.hpp>

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr std::array<std::size_t, 3> kScales{kMinNeighbours, 18, kMaxNeighbours};
constexpr double kSmooth = 0.03;       // roughness up to which the smallest scale will do
constexpr double kFarthestLoss = 0.75; // of its weight
constexpr double kWideGap = 0.75;      // squared cosine of 150 degrees
constexpr double kLine = 1e-4;         // of the largest moment: below, the middle one is that of a line

using Matrix = std::array<std::array<double, 3>, 3>;

// Eigenvectors of a symmetric matrix as columns of `vectors`, eigenvalues on the diagonal of `m`.
// Based on: Golub, Van Loan. Matrix Computations. Section 8.5, cyclic Jacobi rotations
void diagonalise(Matrix &m, Matrix &vectors) {
    vectors = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    constexpr int kMaxSweeps = 12; // convergence is quadratic: 4 or 5 do
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
        const double off = std::fabs(m[0][1]) + std::fabs(m[0][2]) + std::fabs(m[1][2]);
        if (off <= 1e-14 * (m[0][0] + m[1][1] + m[2][2]))
            return;
        for (const auto &[p, q, r] : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 1}, {1, 2, 0}}) {
            if (m[p][q] == 0)
                continue;
            const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
            const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
            const double c = 1 / std::sqrt(t * t + 1), s = t * c;
            const double pq = m[p][q], pr = m[p][r], qr = m[q][r];
            m[p][p] -= t * pq;
            m[q][q] += t * pq;
            m[p][q] = m[q][p] = 0;
            m[p][r] = m[r][p] = c * pr - s * qr;
            m[q][r] = m[r][q] = s * pr + c * qr;
            for (auto &row : vectors) {
                const double vp = row[p], vq = row[q];
                row[p] = c * vp - s * vq;
                row[q] = s * vp + c * vq;
            }
        }
    }
}

struct Plane {
    glm::dvec3 normal{0}; // zero where the points lie on a line
    glm::dvec3 along{0};  // in the plane; zero with the normal
    double roughness = 1; // least moment to middle one, 0..1
};

// The plane through a point and others at `offsets` from it.
Plane fit_plane(std::span<const glm::dvec3> offsets, std::span<const double> weights) {
    double weight = 1; // of the point itself, at offset 0
    glm::dvec3 mean(0);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
        weight += weights[i];
        mean += weights[i] * offsets[i];
    }
    mean /= weight;
    Matrix m{};
    const auto add = [&](const glm::dvec3 &d, double w) {
        m[0][0] += w * d.x * d.x;
        m[0][1] += w * d.x * d.y;
        m[0][2] += w * d.x * d.z;
        m[1][1] += w * d.y * d.y;
        m[1][2] += w * d.y * d.z;
        m[2][2] += w * d.z * d.z;
    };
    add(mean, 1);
    for (std::size_t i = 0; i < offsets.size(); ++i)
        add(offsets[i] - mean, weights[i]);
    m[1][0] = m[0][1];
    m[2][0] = m[0][2];
    m[2][1] = m[1][2];
    Matrix vectors;
    diagonalise(m, vectors);
    std::size_t least = 0, most = 0;
    for (std::size_t k = 1; k < 3; ++k) {
        least = m[k][k] < m[least][least] ? k : least;
        most = m[k][k] >= m[most][most] ? k : most;
    }
    const std::size_t middle = least == most ? most : 3 - least - most;
    if (!(m[middle][middle] > kLine * m[most][most]))
        return {};
    return {{vectors[0][least], vectors[1][least], vectors[2][least]},
            {vectors[0][most], vectors[1][most], vectors[2][most]},
            std::max(0.0, m[least][least]) / m[middle][middle]};
}

Plane plane_at(const std::vector<LatticePoint> &points, std::size_t point, std::span<const NearPoint> found) {
    const double farthest = found.empty() ? 0 : found.back().squared_distance;
    if (!(farthest > 0))
        return {};
    const double scale = 1 / std::sqrt(farthest);
    std::array<glm::dvec3, kMaxNeighbours> offsets;
    std::array<double, kMaxNeighbours> weights{};
    for (std::size_t k = 0; k < found.size(); ++k) {
        offsets[k] = glm::dvec3(points[found[k].point] - points[point]) * scale;
        weights[k] = 1 - kFarthestLoss * (found[k].squared_distance / farthest);
    }
    return fit_plane(std::span(offsets).first(found.size()), std::span(weights).first(found.size()));
}

// Whether the directions of the nearest few leave a gap of 150 degrees: some direction then has no other one within 150
// degrees to its left.
bool is_at_border(const std::vector<LatticePoint> &points, std::size_t point, std::span<const NearPoint> near,
                  const Plane &plane) {
    const glm::dvec3 &n = plane.normal, &u = plane.along;
    const glm::dvec3 v(n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x);
    std::array<glm::dvec2, kMinNeighbours> at;
    const std::size_t count = std::min(near.size(), at.size());
    for (std::size_t k = 0; k < count; ++k) {
        const glm::dvec3 e = glm::dvec3(points[near[k].point] - points[point]);
        at[k] = {(e.x * u.x + e.y * u.y) + e.z * u.z, (e.x * v.x + e.y * v.y) + e.z * v.z};
    }
    const auto follows = [](const glm::dvec2 &a, const glm::dvec2 &b) { // within 150 degrees to the left
        const double inner = a.x * b.x + a.y * b.y;
        return a.x * b.y - a.y * b.x > 0 &&
               (inner >= 0 || inner * inner < kWideGap * (a.x * a.x + a.y * a.y) * (b.x * b.x + b.y * b.y));
    };
    const auto directions = std::span(at).first(count);
    return std::any_of(directions.begin(), directions.end(), [&](const glm::dvec2 &a) {
        return std::none_of(directions.begin(), directions.end(), [&](const glm::dvec2 &b) { return follows(a, b); });
    });
}

void keep_links(PointLinks &links, std::size_t point, std::span<const NearPoint> found) {
    const std::size_t count = std::min(kLinks, found.size());
    double sum = 0;
    for (std::size_t k = 0; k < kLinks; ++k) {
        links.nearest[point * kLinks + k] = k < count ? found[k].point : static_cast<std::uint32_t>(point);
        sum += k < count ? std::sqrt(found[k].squared_distance) : 0;
    }
    links.spacing[point] = count > 0 ? static_cast<float>(sum / static_cast<double>(count)) : 0;
}

} // namespace

PlaneFits fit_planes(const PointNeighbours &neighbours, int threads) {
    const std::vector<LatticePoint> &points = neighbours.points();
    const std::size_t count = points.size();
    PlaneFits fits{{std::vector<std::uint32_t>(count * kLinks), std::vector<float>(count)},
                   std::vector<ShortNormal>(count),
                   Bytes(count)};
    parallel_blocks(count, kBlock, threads, [&](std::size_t begin, std::size_t end) {
        NeighbourCursor small(neighbours), large(neighbours);
        for (std::size_t i = begin; i < end; ++i) {
            std::array<NearPoint, kMaxNeighbours> found;
            const std::size_t few = small.nearest(i, std::span(found).first(kScales.front()));
            auto near = std::span(found).first(few);
            keep_links(fits.links, i, near);
            Plane best = plane_at(points, i, near);
            if (best.roughness > kSmooth) {
                near = std::span(found).first(large.nearest(i, found));
                for (std::size_t scale = 1; scale < kScales.size(); ++scale) {
                    const Plane plane = plane_at(points, i, near.first(std::min(near.size(), kScales[scale])));
                    if (plane.roughness < best.roughness)
                        best = plane;
                }
            }
            fits.normals[i] = to_short_normal(best.normal);
            fits.at_border[i] = is_at_border(points, i, near.first(few), best) ? 1 : 0;
        }
    });
    return fits;
}

} // namespace pbm::build
