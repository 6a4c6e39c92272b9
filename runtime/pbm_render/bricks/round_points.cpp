#include "pbm_render/bricks/round_points.h"

#include "pbm_format/model/point_values.h"
#include "pbm_render/camera/normal_table.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm {
namespace {

constexpr double kRoundCover = 0.5; // minimum radius over the edge of a node of several points
constexpr double kRoundedUp = 0.06; // of radii up to the coarse levels, each rounded upwards

} // namespace

bool has_round_points(const ModelParameters &parameters) {
    return std::any_of(parameters.materials.begin(), parameters.materials.end(), is_round);
}

std::uint8_t drawn_radius(std::uint8_t stored, int level, int depth) {
    if (level >= depth)
        return stored;
    const double edge = std::ldexp(1.0, -level), growth = std::sqrt(0.75) * (edge - std::ldexp(1.0, -depth));
    const double below = (1 - kRoundedUp) * radius_fraction(stored) - growth;
    return std::min(stored, radius_index(std::max(below, kRoundCover * edge)));
}

void mark_round_points(PointView &points, const ModelParameters &parameters, int level, RoundPoints &to) {
    const std::vector<Material> &materials = parameters.materials;
    const auto is_round_point = [&](std::size_t i) {
        const std::size_t material = points.materials.empty() ? 0 : points.materials[i];
        return is_round(materials[std::min(material, materials.size() - 1)]); // mapped bytes may change
    };
    std::size_t first = 0;
    const std::size_t count = has_round_points(parameters) ? points.normals.size() : 0;
    while (first < count && !is_round_point(first))
        ++first;
    if (first == count)
        return;
    std::array<std::uint8_t, 256> radii{};
    for (std::size_t i = 0; i < radii.size(); ++i)
        radii[i] = drawn_radius(static_cast<std::uint8_t>(i), level, parameters.grid.depth);
    to.normals.assign(points.normals.begin(), points.normals.end());
    to.radii.assign(points.radii.begin(), points.radii.end());
    for (std::size_t i = first; i < count; ++i)
        if (is_round_point(i)) {
            to.normals[i] |= kRoundBit | kTwoSidedBit;
            to.radii[i] = radii[to.radii[i]];
        }
    points.normals = to.normals;
    points.radii = to.radii;
}

} // namespace pbm
