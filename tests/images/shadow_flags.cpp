#include "shadow_flags.h"

#include "pbm_format/normal.h"
#include "pbm_format/octree.h"
#include "pbm_format/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <mutex>

namespace pbm {
namespace {

constexpr std::size_t kBlock = 16384;
// Voxel edges. The surface passes through a point's voxel, so no farther along its normal than half a diagonal.
constexpr double kFarthestSurface = 0.87;
// Beside the edge of the cube: as far off the surface a strict ray begins.
constexpr double kOffSurface = 1e-5;
constexpr double kLift = 0.25; // voxel edges; that of other rays

// Where the surface that a point stands for is met, a little outside of it; the point itself where none is near.
glm::dvec3 start_on_surface(const RayCaster &rays, const glm::dvec3 &centre, const glm::dvec3 &normal, double voxel,
                            double edge) {
    double nearest = std::numeric_limits<double>::infinity();
    glm::dvec3 start = centre;
    for (const double side : {1.0, -1.0}) {
        const auto hit = rays.nearest(centre, side * normal);
        const double distance = hit ? static_cast<double>(hit->distance) : nearest;
        const bool outside = hit && glm::dot(glm::dvec3(hit->face), normal) > 0;
        if (outside && distance < nearest && distance <= kFarthestSurface * voxel) {
            nearest = distance;
            start = centre + side * distance * normal + kOffSurface * edge * glm::dvec3(hit->face);
        }
    }
    return start;
}

struct Way {
    glm::dvec3 to_light; // unit vector
    double distance;
};

Way way_to(const Light &light, const Grid &grid, const glm::dvec3 &from) {
    if (light.kind == LightKind::directional)
        return {-glm::dvec3(light.direction[0], light.direction[1], light.direction[2]),
                std::numeric_limits<double>::infinity()};
    const glm::dvec3 at = glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) +
                          glm::dvec3(light.position[0], light.position[1], light.position[2]);
    const double distance = glm::length(at - from);
    return {(at - from) / distance, distance};
}

std::vector<MortonCode> finest_codes(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = expand_level(codes, model.levels[level].masks, model.levels[level].points.size()).value();
    return codes;
}

} // namespace

std::vector<FlagFigures> check_flags(const RayCaster &rays, const Model &model, int threads) {
    const Grid &grid = model.parameters.grid;
    const PointAttributes &points = model.levels.back().points;
    const std::vector<MortonCode> codes = finest_codes(model);
    const auto lights = static_cast<std::size_t>(model.parameters.attributes.lights);
    std::vector<FlagFigures> figures(lights);
    std::mutex mutex;
    parallel_for((codes.size() + kBlock - 1) / kBlock, threads, [&](std::size_t block) {
        std::vector<FlagFigures> found(lights);
        for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, codes.size()); ++i) {
            if ((points.normals[i] & kTwoSidedBit) != 0)
                continue;
            const auto [x, y, z] = morton_decode(codes[i]);
            const glm::dvec3 centre = glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) +
                                      grid.voxel_size * glm::dvec3(x + 0.5, y + 0.5, z + 0.5);
            const UnitVector &n = normal_table()[points.normals[i] & kNormalIndexMask];
            const glm::dvec3 normal(n[0], n[1], n[2]);
            const glm::dvec3 start = start_on_surface(rays, centre, normal, grid.voxel_size, grid.edge());
            for (std::size_t light = 0; light < lights; ++light) {
                const Way way = way_to(model.parameters.lights[light], grid, start);
                if (glm::dot(normal, way.to_light) <= 0)
                    continue;
                const unsigned most =
                    (1U << model.parameters.attributes.shadow_bits[light].at(static_cast<std::size_t>(grid.depth))) - 1;
                const bool baked = 2U * points.shadows[light][i] > most;
                const glm::dvec3 above = start + kLift * grid.voxel_size * normal;
                const bool lit = !rays.is_blocked(above, way.to_light, way.distance);
                const bool strictly_lit = !rays.is_blocked(start, way.to_light, way.distance);
                ++found[light].facing;
                found[light].lit += lit;
                found[light].falsely_lit += baked && !lit;
                found[light].falsely_dark += !baked && lit;
                found[light].strictly_wrong += baked != strictly_lit;
            }
        }
        const std::scoped_lock lock(mutex);
        for (std::size_t light = 0; light < lights; ++light) {
            figures[light].facing += found[light].facing;
            figures[light].lit += found[light].lit;
            figures[light].falsely_lit += found[light].falsely_lit;
            figures[light].falsely_dark += found[light].falsely_dark;
            figures[light].strictly_wrong += found[light].strictly_wrong;
        }
    });
    return figures;
}

} // namespace pbm
