#include "voxel_model.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm {
namespace {

struct Sample {
    MortonCode code;
    glm::vec3 normal;
};

// Separating axes of a triangle and a unit cube around the origin.
// Based on: Akenine-Moller. Fast 3D Triangle-Box Overlap Testing. 2001
bool touches_unit_cube(const std::array<glm::dvec3, 3> &t) {
    const auto separated = [&](const glm::dvec3 &axis) {
        const double reach = 0.5 * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
        const double a = glm::dot(axis, t[0]), b = glm::dot(axis, t[1]), c = glm::dot(axis, t[2]);
        return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
    };
    const std::array<glm::dvec3, 3> edges{t[1] - t[0], t[2] - t[1], t[0] - t[2]};
    const std::array<glm::dvec3, 3> axes{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)};
    for (const glm::dvec3 &axis : axes) {
        if (separated(axis))
            return false;
        for (const glm::dvec3 &edge : edges)
            if (separated(glm::cross(axis, edge)))
                return false;
    }
    return !separated(glm::cross(edges[0], edges[1]));
}

} // namespace

Model voxelise_by_brute_force(const TriangleMesh &mesh, int depth, double cube_edge) {
    Model model;
    model.metadata = "{}";
    Grid &grid = model.parameters.grid;
    grid.depth = depth;
    grid.voxel_size = cube_edge / static_cast<double>(1 << depth);
    grid.origin = {-cube_edge / 2, -cube_edge / 2, -cube_edge / 2};
    model.parameters.materials.resize(1);

    std::vector<Sample> samples;
    for (const glm::uvec3 &triangle : mesh.triangles) {
        std::array<glm::dvec3, 3> corners; // in voxels
        for (int i = 0; i < 3; ++i)
            corners[static_cast<std::size_t>(i)] = (mesh.positions[triangle[i]] + cube_edge / 2) / grid.voxel_size;
        const glm::vec3 normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
        const glm::ivec3 low = glm::floor(glm::min(corners[0], glm::min(corners[1], corners[2])));
        const glm::ivec3 high = glm::floor(glm::max(corners[0], glm::max(corners[1], corners[2])));
        for (int z = low.z; z <= high.z; ++z) {
            for (int y = low.y; y <= high.y; ++y) {
                for (int x = low.x; x <= high.x; ++x) {
                    const glm::dvec3 centre = glm::dvec3(x, y, z) + 0.5;
                    if (touches_unit_cube({corners[0] - centre, corners[1] - centre, corners[2] - centre}))
                        samples.push_back({morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                                         static_cast<std::uint32_t>(z)),
                                           normal});
                }
            }
        }
    }
    std::stable_sort(samples.begin(), samples.end(), [](const Sample &a, const Sample &b) { return a.code < b.code; });

    std::vector<MortonCode> codes;
    PointAttributes points;
    for (std::size_t i = 0; i < samples.size();) {
        const MortonCode code = samples[i].code;
        glm::vec3 sum(0);
        float votes = 0;
        for (; i < samples.size() && samples[i].code == code; ++i, ++votes)
            sum += samples[i].normal;
        codes.push_back(code);
        const auto index = quantise_normal(sum.x, sum.y, sum.z);
        points.normals.push_back(glm::length(sum) < votes / 2 ? static_cast<std::uint16_t>(index | kTwoSidedBit)
                                                              : index);
    }
    points.radii.assign(codes.size(), radius_index(0.87 / static_cast<double>(1 << depth)));

    set_levels(model, std::move(codes), std::move(points), 1);
    return model;
}

} // namespace pbm
