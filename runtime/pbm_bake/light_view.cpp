#include "pbm_bake/light_view.h"

#include "pbm_surface/carried_offsets.h"

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

// The rays of a light farther away than this many model radii count as parallel.
constexpr double kParallelFrom = 1 << 20;
constexpr double kFarthest = 1e30; // voxels; its square is finite
// A light nearer than this many model radii needs six views: one view covers 90 degrees.
constexpr double kOneViewFrom = 1.5;

// Cosines and sines of the rotations that maps use cyclically: Pythagorean triples.
constexpr std::array<std::array<double, 2>, 4> kTurns{
    {{1, 0}, {4. / 5, 3. / 5}, {12. / 13, 5. / 13}, {15. / 17, 8. / 17}}};

Vector3 operator+(const Vector3 &a, const Vector3 &b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vector3 operator-(const Vector3 &a, const Vector3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector3 operator*(const Vector3 &a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
double dot(const Vector3 &a, const Vector3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector3 cross(const Vector3 &a, const Vector3 &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector3 normalise(const Vector3 &a) { return a * (1 / std::sqrt(dot(a, a))); }

// A right-handed frame whose last axis is `forward`; `turn` rotates the other two around it.
std::array<Vector3, 3> axes_along(const Vector3 &forward, const std::array<double, 2> &turn) {
    std::size_t least = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
        if (std::abs(forward[axis]) < std::abs(forward[least]))
            least = axis;
    Vector3 across{};
    across[least] = 1;
    const Vector3 x = normalise(cross(across, forward)), y = cross(forward, x);
    return {x * turn[0] + y * turn[1], y * turn[0] - x * turn[1], forward};
}

// Term `i` of a low-discrepancy sequence in [0, 1): axes 0 and 1 fill the square, axes 0 to 2 the cube.
// Based on: Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018
double spread(std::uint32_t i, std::size_t axis) {
    constexpr std::array<std::uint32_t, 3> kSteps{3518319155U, 2882110345U, 2360945575U}; // 2^32 / 1.2207..^k
    return static_cast<double>((i + 1) * kSteps[axis] + 0x80000000U) * 0x1p-32;
}

// Point `i` within a disc of diameter 1 (`axes` = 2) or a ball (3), from that sequence.
Vector3 place_on_light(int i, std::size_t axes) {
    std::uint32_t term = 0;
    for (;; ++term) {
        Vector3 at{};
        for (std::size_t axis = 0; axis < axes; ++axis)
            at[axis] = spread(term, axis) - 0.5;
        if (dot(at, at) <= 0.25 && i-- == 0)
            return at;
    }
}

struct Ball {
    Vector3 centre;
    double radius;
};

// Bounding sphere of the bricks, enlarged by 2 voxels, in voxels.
Ball bounds_of(const ShadowCasters &casters) {
    std::array<int, 3> low{1 << 20, 1 << 20, 1 << 20}, high{};
    const auto bricks = casters.bricks();
    for (std::size_t b = 0; b + 1 < bricks.size(); ++b)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], 8 * bricks[b].corner[axis]);
            high[axis] = std::max(high[axis], 8 * bricks[b].corner[axis] + 8);
        }
    const Vector3 a{static_cast<double>(low[0]), static_cast<double>(low[1]), static_cast<double>(low[2])};
    const Vector3 b{static_cast<double>(high[0]), static_cast<double>(high[1]), static_cast<double>(high[2])};
    const Vector3 diagonal = b - a;
    return {(a + b) * 0.5, std::sqrt(dot(diagonal, diagonal)) / 2 + 2};
}

// Where the whole light lies relative to the model.
enum class ViewKind { parallel, from_outside, all_around };

ViewKind kind_of_view(const LightPlace &light, const Ball &ball, double size) {
    const Vector3 way = ball.centre - light.position;
    const double distance = std::sqrt(dot(way, way));
    if (light.parallel || distance > kParallelFrom * ball.radius)
        return ViewKind::parallel;
    return distance - size / 2 >= kOneViewFrom * ball.radius ? ViewKind::from_outside : ViewKind::all_around;
}

// part_of_light() for a model with the bounding sphere `ball`.
LightPlace part_of(const LightPlace &light, const Ball &ball, int part, double size) {
    const Vector3 way = ball.centre - light.position;
    const double distance = std::sqrt(dot(way, way));
    LightPlace from = light;
    switch (kind_of_view(light, ball, size)) {
    case ViewKind::parallel: {
        const Vector3 forward = light.parallel ? light.direction : way * (1 / distance), at = place_on_light(part, 2);
        const double spread_by = light.parallel ? size : size / distance;
        const auto axes = axes_along(forward, {1, 0});
        from.parallel = true;
        from.direction = normalise(forward + (axes[0] * at[0] + axes[1] * at[1]) * spread_by);
        break;
    }
    case ViewKind::from_outside: {
        const Vector3 at = place_on_light(part, 2);
        const auto axes = axes_along(way * (1 / distance), {1, 0});
        from.position = light.position + (axes[0] * at[0] + axes[1] * at[1]) * size;
        break;
    }
    case ViewKind::all_around: from.position = light.position + place_on_light(part, 3) * size; break;
    }
    return from;
}

} // namespace

LightPlace place_light(const Light &light, const ShadowCasters &casters) {
    LightPlace place;
    place.parallel = light.kind == LightKind::directional;
    place.spot = light.kind == LightKind::spot;
    double farthest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        place.direction[axis] = static_cast<double>(light.direction[axis]);
        place.position[axis] = static_cast<double>(light.position[axis]);
        farthest = std::max(farthest, std::abs(place.position[axis]));
    }
    // Clamp: beyond this distance only the direction matters.
    const double limit = kFarthest * casters.voxel_size();
    place.position = place.position * ((farthest > limit ? limit / farthest : 1) / casters.voxel_size());
    if (light.kind != LightKind::point)
        place.direction = normalise(place.direction);
    return place;
}

LightPlace part_of_light(const LightPlace &light, const ShadowCasters &casters, int part, double size) {
    return part_of(light, bounds_of(casters), part, size);
}

std::vector<LightView> views_of_map(const LightPlace &light, const ShadowCasters &casters, int map, double size) {
    const Ball ball = bounds_of(casters);
    const auto &turn = kTurns[static_cast<std::size_t>(map) % kTurns.size()];
    const LightPlace part = part_of(light, ball, map, size);
    LightView view;
    view.shift_u = spread(static_cast<std::uint32_t>(map), 0);
    view.shift_v = spread(static_cast<std::uint32_t>(map), 1);
    view.origin = ball.centre;
    if (part.parallel) {
        view.axes = axes_along(part.direction, turn);
        return {view};
    }
    const Vector3 from = part.position, to = ball.centre - from;
    if (kind_of_view(light, ball, size) == ViewKind::from_outside) {
        const double length = std::sqrt(dot(to, to));
        view.axes = axes_along(to * (1 / length), turn);
        view.inverse_distance = 1 / length;
        return {view};
    }
    // A texel is one voxel wide at this distance from the light.
    const double near = std::max({std::sqrt(dot(to, to)), ball.radius / 2, 16.0});
    // The views are not aligned with the grid, so that no view sees axis-aligned surfaces edge-on.
    const auto axes = axes_along(normalise({2, 3, 6}), turn);
    std::vector<LightView> views;
    for (int face = 0; face < 6; ++face) {
        const std::size_t axis = static_cast<std::size_t>(face) / 2;
        const double sign = face % 2 == 0 ? 1 : -1;
        view.face = face;
        view.axes = {axes[(axis + 1) % 3] * sign, axes[(axis + 2) % 3], axes[axis] * sign};
        view.origin = from + view.axes[2] * near;
        view.inverse_distance = 1 / near;
        views.push_back(view);
    }
    return views;
}

} // namespace pbm
