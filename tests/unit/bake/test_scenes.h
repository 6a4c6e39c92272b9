// Small scenes of voxels whose shadows are known, for tests of the shadow baker.
#pragma once

#include "pbm_bake/shadow_baker.h"
#include "pbm_format/model/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace pbm::test {

// Voxels in a cube of edge 64; a voxel is one model unit wide and has one normal; radius 0.87 voxels.
class VoxelScene {
  public:
    static constexpr int kDepth = 6, kEdge = 1 << kDepth;

    void add(int x, int y, int z, std::array<double, 3> normal, bool two_sided = false) {
        const std::uint16_t index = quantise_normal(normal[0], normal[1], normal[2]);
        voxels_[morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                              static_cast<std::uint32_t>(z))] =
            two_sided ? static_cast<std::uint16_t>(index | kTwoSidedBit) : index;
    }
    // A sheet at height y, facing up.
    void add_sheet(int x0, int x1, int z0, int z1, int y, bool two_sided = false) {
        for (int z = z0; z < z1; ++z)
            for (int x = x0; x < x1; ++x)
                add(x, y, z, {0, 1, 0}, two_sided);
    }
    void add_sphere(std::array<double, 3> centre, double radius) {
        for (int z = 0; z < kEdge; ++z)
            for (int y = 0; y < kEdge; ++y)
                for (int x = 0; x < kEdge; ++x) {
                    const std::array<double, 3> out{x + 0.5 - centre[0], y + 0.5 - centre[1], z + 0.5 - centre[2]};
                    const double distance = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
                    const double reach =
                        (std::abs(out[0]) + std::abs(out[1]) + std::abs(out[2])) / std::max(distance, 1e-9) / 2;
                    if (std::abs(distance - radius) <= reach)
                        add(x, y, z, out);
                }
    }

    Model model(bool closed = true) const {
        Model model;
        model.parameters.closed = closed;
        model.parameters.grid = {.depth = kDepth, .origin = {-100, 50, 7}, .voxel_size = 1};
        model.parameters.materials.resize(1);
        std::vector<MortonCode> codes;
        PointAttributes points;
        for (const auto &[code, normal] : voxels_) {
            codes.push_back(code);
            points.normals.push_back(normal);
        }
        points.radii.assign(codes.size(), radius_index(0.87 / kEdge));
        set_levels(model, std::move(codes), std::move(points), 1);
        return model;
    }

    // Index of the point in voxel (x, y, z).
    std::size_t index(int x, int y, int z) const {
        const MortonCode code =
            morton_encode(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z));
        return static_cast<std::size_t>(std::distance(voxels_.begin(), voxels_.find(code)));
    }

  private:
    std::map<MortonCode, std::uint16_t> voxels_;
};

inline Light sun(std::array<double, 3> direction) {
    const double length =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    Light light;
    for (std::size_t axis = 0; axis < 3; ++axis)
        light.direction[axis] = static_cast<float>(direction[axis] / length);
    return light;
}
inline Light lamp(std::array<float, 3> position) { return {.kind = LightKind::point, .position = position}; }

} // namespace pbm::test
