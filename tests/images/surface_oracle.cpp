#include "surface_oracle.h"

#include "pbm_format/model/normal.h"
#include "pbm_format/model/octree.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <vector>

namespace pbm {
namespace {

constexpr double kDiscRadius = 0.6; // voxel edges: about half of a splat's diameter
constexpr int kRaysAcross = 5;
constexpr double kBelowTriangle = 1e-3; // voxel edges: a ray continues so far behind a triangle
constexpr std::size_t kOraclePoints = 4096;

glm::dvec3 table_normal(std::uint16_t stored) {
    const UnitVector &n = normal_table()[stored & kNormalIndexMask];
    return {n[0], n[1], n[2]};
}

struct Disc {
    glm::dvec3 across, along; // unit vectors in the plane
};

Disc disc_of(const glm::dvec3 &normal) {
    const glm::dvec3 other = std::abs(normal.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 across = glm::normalize(glm::cross(normal, other));
    return {across, glm::cross(normal, across)};
}

glm::dvec3 centre_of(const Grid &grid, const std::array<std::uint32_t, 3> &voxel, double edge) {
    return {grid.origin[0] + (voxel[0] + 0.5) * edge, grid.origin[1] + (voxel[1] + 0.5) * edge,
            grid.origin[2] + (voxel[2] + 0.5) * edge};
}

// Height of the first triangle that faces along `normal`, voxel edges above the plane through `from`.
std::optional<double> height_at(const RayCaster &rays, const glm::dvec3 &from, const glm::dvec3 &normal, double voxel,
                                double top) {
    for (double height = top; height >= -top;) {
        const auto hit = rays.nearest(from + normal * (height * voxel), -normal * voxel);
        if (!hit)
            return std::nullopt;
        height -= static_cast<double>(hit->distance);
        if (glm::dot(glm::dvec3(hit->face), normal) > 0)
            return height >= -top ? std::optional(height) : std::nullopt;
        height -= kBelowTriangle;
    }
    return std::nullopt;
}

} // namespace

std::optional<LocalPlane> SurfaceOracle::plane_at(const glm::dvec3 &centre, const glm::dvec3 &normal,
                                                  double voxel) const {
    const Disc disc = disc_of(normal);
    glm::dmat3 products(0);
    glm::dvec3 sums(0);
    int rays = 0, hits = 0;
    for (int i = 0; i < kRaysAcross; ++i)
        for (int k = 0; k < kRaysAcross; ++k) {
            const double u = (2.0 * i / (kRaysAcross - 1) - 1) * kDiscRadius,
                         v = (2.0 * k / (kRaysAcross - 1) - 1) * kDiscRadius;
            if (u * u + v * v > kDiscRadius * kDiscRadius * 1.01)
                continue;
            ++rays;
            const auto height = height_at(rays_, centre + (disc.across * u + disc.along * v) * voxel, normal, voxel,
                                          static_cast<double>(kMaxOffset));
            if (!height)
                continue;
            ++hits;
            const glm::dvec3 row(u, v, 1);
            products += glm::outerProduct(row, row);
            sums += row * *height;
        }
    if (2 * hits <= rays || std::abs(glm::determinant(products)) < 1e-6)
        return std::nullopt;
    const glm::dvec3 plane = glm::inverse(products) * sums;
    return LocalPlane{glm::normalize(normal - disc.across * plane.x - disc.along * plane.y), plane.z};
}

void SurfaceOracle::replace_normals(Model &model) const {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        std::vector<std::uint16_t> &normals = model.levels[level].points.normals;
        codes = expand_level(codes, model.levels[level].masks, normals.size()).value();
        const double edge = grid_.voxel_size_at(static_cast<int>(level));
        parallel_for((normals.size() + kOraclePoints - 1) / kOraclePoints, 0, [&](std::size_t block) {
            const std::size_t end = std::min(normals.size(), (block + 1) * kOraclePoints);
            for (std::size_t i = block * kOraclePoints; i < end; ++i) {
                if ((normals[i] & kTwoSidedBit) != 0)
                    continue;
                const auto plane =
                    plane_at(centre_of(grid_, morton_decode(codes[i]), edge), table_normal(normals[i]), edge);
                if (plane)
                    normals[i] = quantise_normal(plane->normal.x, plane->normal.y, plane->normal.z);
            }
        });
    }
}

void SurfaceOracle::replace_offsets(std::span<PointRun> runs) {
    for (PointRun &run : runs) {
        std::unique_ptr<ChunkOffsets> &known = offsets_[run.chunk];
        if (!known) {
            const ChunkView &chunk = *run.chunk;
            known = std::make_unique<ChunkOffsets>();
            std::vector<VisibleBrick> all(chunk.bricks.size());
            for (std::size_t i = 0; i < all.size(); ++i) {
                all[i].brick = static_cast<std::uint32_t>(i);
                all[i].faces_eye = true;
            }
            known->estimate(chunk, all); // and keeps what is replaced here
            const double edge = grid_.voxel_size_at(run.level);
            parallel_for(chunk.bricks.size(), 0, [&](std::size_t b) {
                const BrickRecord &brick = chunk.bricks[b];
                BrickOffsets unused;
                auto *const offsets =
                    const_cast<std::int8_t *>(known->read(chunk, static_cast<std::uint32_t>(b), unused));
                std::size_t point = brick.first_point, node = brick.first_node;
                for (std::uint64_t map = brick.node_map; map != 0; map &= map - 1, ++node)
                    for (unsigned mask = chunk.masks[node]; mask != 0; mask &= mask - 1, ++point) {
                        const std::uint16_t stored = chunk.normals[point];
                        if ((stored & kTwoSidedBit) != 0)
                            continue;
                        const auto place = static_cast<MortonCode>(std::countr_zero(map)) * 8 +
                                           static_cast<MortonCode>(std::countr_zero(mask));
                        const auto local = morton_decode(place);
                        const glm::dvec3 centre = centre_of(
                            grid_, {8U * brick.x + local[0], 8U * brick.y + local[1], 8U * brick.z + local[2]}, edge);
                        const auto plane = plane_at(centre, table_normal(stored), edge);
                        if (!plane)
                            continue;
                        const double steps = std::clamp(plane->offset, -0.86, 0.86) * static_cast<double>(kOffsetSteps);
                        const int even = 2 * static_cast<int>(std::lround(steps / 2));
                        offsets[point - brick.first_point] =
                            static_cast<std::int8_t>(even | (offsets[point - brick.first_point] & kRedundantBit));
                    }
            });
        }
        run.offsets = known.get();
    }
}

} // namespace pbm
