#include "pbm_render/camera/normal_table.h"

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

// The voxels along a plane form a staircase, and splats must be thick enough to close its risers. The thickness that
// closes them for radius 0.89, any view and any position of the plane was found by search: 0.55 voxel edges for normals
// near an axis, 0.37 elsewhere. The function adds a little, because surfaces are not planes.
double min_thickness(const UnitVector &n) {
    const double steepest = std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])});
    return std::clamp(0.47 + 1.9 * (steepest - 0.87), 0.47, 0.64);
}

// The centres of these voxels lie up to (|x| + |y| + |z|) / 2 in front of the plane, and the z-buffer shows the
// foremost ones. Returns their mean distance, found by the same search.
double mean_front(const UnitVector &n) { return std::min(std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]) - 1, 0.58); }

} // namespace

std::span<const SplatNormal> splat_normals() {
    static const std::vector<SplatNormal> kTable = [] {
        std::vector<SplatNormal> table;
        table.reserve(kNormalCount);
        for (const UnitVector &n : normal_table())
            table.push_back({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2]),
                             static_cast<float>(mean_front(n))});
        return table;
    }();
    return kTable;
}

std::span<const float> splat_thickness() {
    static const std::vector<float> kTable = [] {
        std::vector<float> table;
        table.reserve(kNormalCount);
        for (const UnitVector &n : normal_table())
            table.push_back(static_cast<float>(min_thickness(n)));
        return table;
    }();
    return kTable;
}

const std::array<float, 256> &radius_table() {
    static const std::array<float, 256> kTable = [] {
        std::array<float, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i)
            table[i] = static_cast<float>(radius_fraction(static_cast<std::uint8_t>(i)));
        return table;
    }();
    return kTable;
}

std::vector<ScreenNormal> transform_normals(const Projection &projection) {
    std::vector<ScreenNormal> screen(kNormalCount);
    const std::span<const UnitVector> table = normal_table();
    const std::span<const SplatNormal> splats = splat_normals();
    const std::span<const float> thickness = splat_thickness();
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = table[i];
        screen[i] = {projection.vector({n[0], n[1], n[2]}), projection.plane({n[0], n[1], n[2]}), thickness[i],
                     splats[i].inset};
    }
    if (projection.has_round_points) {
        const glm::dvec3 facing = -projection.axes.forward;
        append_facing(screen, {projection.vector(facing), projection.plane(facing), 0, 0});
    }
    return screen;
}

} // namespace pbm
