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

void mark_round_points(PointView &points, const ModelParameters &parameters, int level, MarkedPoints &to) {
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

bool mark_hidden_points(PointView &points, const HiddenClasses &hidden, ByteView classes, MarkedPoints &to) {
    const std::uint8_t bytes = hidden.description.bytes;
    const auto is_hidden = [&](std::size_t i) { return hidden.hides[stored_value(classes, i, bytes)] != 0; };
    const std::size_t count = std::min(points.normals.size(), classes.size() / bytes);
    std::size_t first = 0;
    while (first < count && !is_hidden(first))
        ++first;
    if (first == count)
        return false;
    if (to.normals.empty())
        to.normals.assign(points.normals.begin(), points.normals.end());
    for (std::size_t i = first; i < count; ++i)
        if (is_hidden(i))
            to.normals[i] |= kHiddenBits;
    points.normals = to.normals;
    return true;
}

void hide_points(Model &model, const HiddenClasses &hidden) {
    for (Level &level : model.levels) {
        MarkedPoints marked;
        PointView points = view_points(level.points, 0, level.points.size(), model.parameters.attributes);
        if (mark_hidden_points(points, hidden, level.fields[hidden.field], marked))
            std::copy(marked.normals.begin(), marked.normals.end(), level.points.normals.begin());
    }
}

} // namespace pbm
