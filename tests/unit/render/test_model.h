// Tiny models for the renderer's tests.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace pbm {

inline constexpr float kEmpty = std::numeric_limits<float>::infinity(); // depth of a pixel that shows nothing

struct TestVoxel {
    std::array<std::uint32_t, 3> place;    // x, y, z
    std::array<double, 3> normal{0, 0, 1}; // any length
    bool two_sided = false;
};

// Unit voxels, one corner of the cube at the origin, radius 0.89 voxel edges, grey.
inline Model make_test_model(int depth, std::vector<TestVoxel> voxels) {
    std::sort(voxels.begin(), voxels.end(), [](const TestVoxel &a, const TestVoxel &b) {
        return morton_encode(a.place[0], a.place[1], a.place[2]) < morton_encode(b.place[0], b.place[1], b.place[2]);
    });
    Model model;
    model.parameters.grid.depth = depth;
    model.parameters.materials.resize(1);
    std::vector<MortonCode> codes;
    PointAttributes points;
    for (const TestVoxel &voxel : voxels) {
        codes.push_back(morton_encode(voxel.place[0], voxel.place[1], voxel.place[2]));
        const std::uint16_t normal = quantise_normal(voxel.normal[0], voxel.normal[1], voxel.normal[2]);
        points.normals.push_back(static_cast<std::uint16_t>(normal | (voxel.two_sided ? kTwoSidedBit : 0)));
        points.radii.push_back(radius_index(0.87 / static_cast<double>(1 << depth)));
    }
    set_levels(model, std::move(codes), std::move(points), 1);
    return model;
}

// All voxels of one z: a square wall of side 2^depth that faces +Z.
inline Model make_wall(int depth, std::uint32_t z, std::array<double, 3> normal = {0, 0, 1}, bool two_sided = false) {
    std::vector<TestVoxel> voxels;
    for (std::uint32_t y = 0; y < 1U << depth; ++y)
        for (std::uint32_t x = 0; x < 1U << depth; ++x)
            voxels.push_back({{x, y, z}, normal, two_sided});
    return make_test_model(depth, std::move(voxels));
}

// Looks along -Z at `target` from `distance` away.
inline Camera camera_in_front(glm::dvec3 target, double distance) {
    Camera camera;
    camera.focal_point = target;
    camera.position = target + glm::dvec3(0, 0, distance);
    return camera;
}

} // namespace pbm
