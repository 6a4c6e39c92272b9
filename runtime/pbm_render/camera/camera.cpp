#include "pbm_render/camera/camera.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

bool is_finite(const glm::dvec3 &v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool is_usable(const ClipRegion &clip) {
    return (!clip.plane ||
            (is_finite(clip.plane->point) && is_finite(clip.plane->normal) && glm::length(clip.plane->normal) > 0)) &&
           (!clip.box || (is_finite(clip.box->least) && is_finite(clip.box->most)));
}

constexpr std::size_t kMaxVoxels = std::size_t{1} << (3 * kBoundsLevel);

// Lower corners, in voxel edges, of those occupied voxels of `level` that are the first or the last of their row along
// x: of a row, one of these two is farthest from any point.
std::vector<glm::dvec3> voxel_corners(std::span<const ByteView> masks, int level) {
    std::vector<MortonCode> codes{0};
    for (int next = 1; next <= level; ++next) {
        auto below = expand_level(codes, masks[static_cast<std::size_t>(next)], kMaxVoxels);
        assert(below.ok());
        codes = std::move(*below);
    }
    const std::size_t edge = std::size_t{1} << level;
    struct Row {
        std::uint32_t first = ~0U, last = 0;
    };
    std::vector<Row> rows(edge * edge); // [z][y]
    std::vector<std::array<std::uint32_t, 3>> places;
    places.reserve(codes.size());
    for (const MortonCode code : codes) {
        const auto [x, y, z] = places.emplace_back(morton_decode(code));
        Row &row = rows[z * edge + y];
        row = {std::min(row.first, x), std::max(row.last, x)};
    }
    std::vector<glm::dvec3> corners;
    for (const auto &[x, y, z] : places)
        if (const Row &row = rows[z * edge + y]; x == row.first || x == row.last)
            corners.emplace_back(x, y, z);
    return corners;
}

// The corner, among those of all voxels, that is farthest from a point.
glm::dvec3 farthest_corner(const std::vector<glm::dvec3> &voxels, glm::dvec3 from) {
    const glm::dvec3 to_centre = 0.5 - from;
    double longest = 0;
    const glm::dvec3 *farthest = nullptr;
    for (const glm::dvec3 &lower : voxels) {
        const glm::dvec3 reach = glm::abs(lower + to_centre) + 0.5;
        if (const double length = glm::dot(reach, reach); length > longest) {
            longest = length;
            farthest = &lower;
        }
    }
    return *farthest + glm::dvec3(glm::greaterThan(*farthest + to_centre, glm::dvec3(0)));
}

// Centre of the smallest sphere around a few points: moves towards the farthest point in shrinking steps.
glm::dvec3 middle_of(const std::vector<glm::dvec3> &points, glm::dvec3 start) {
    const auto squared_distance = [](glm::dvec3 a, glm::dvec3 b) { return glm::dot(a - b, a - b); };
    glm::dvec3 centre = start;
    double step = 0.5;
    for (int i = 0; i < 150; ++i, step *= 0.94) {
        glm::dvec3 farthest = points.front();
        for (const glm::dvec3 &point : points)
            if (squared_distance(point, centre) > squared_distance(farthest, centre))
                farthest = point;
        centre += step * (farthest - centre);
    }
    return centre;
}

// An approximation of the smallest sphere around voxels: the sphere around a few of their corners, to which the
// farthest corner is added until it lies inside.
// Based on: Badoiu, Clarkson. Smaller core-sets for balls. 2003
Sphere enclose(const std::vector<glm::dvec3> &voxels) {
    constexpr int kMaxSteps = 32;
    constexpr double kWider = 1.001;
    glm::dvec3 low = voxels.front(), high = low;
    for (const glm::dvec3 &lower : voxels) {
        low = glm::min(low, lower);
        high = glm::max(high, lower + 1.0);
    }
    Sphere best{.centre = {}, .radius = std::numeric_limits<double>::infinity()};
    std::vector<glm::dvec3> support;
    glm::dvec3 centre = (low + high) / 2.0;
    for (int i = 0; i < kMaxSteps; ++i) {
        const glm::dvec3 corner = farthest_corner(voxels, centre);
        const double reach = glm::length(corner - centre);
        if (reach < best.radius)
            best = {.centre = centre, .radius = reach};
        double inner = 0; // lower bound of the radius of any sphere around the support
        for (const glm::dvec3 &point : support)
            inner = std::max(inner, glm::length(point - centre));
        if (best.radius <= kWider * inner)
            break;
        support.push_back(corner);
        centre = middle_of(support, centre);
    }
    return best;
}

} // namespace

bool is_usable(const Camera &camera) {
    const glm::dvec3 sight = camera.focal_point - camera.position;
    const double turn = glm::length(glm::cross(sight, camera.up));
    return std::isfinite(turn) && turn > 1e-9 * glm::length(sight) * glm::length(camera.up) &&
           camera.view_angle > 1e-6 && camera.view_angle < 3.14 && is_usable(camera.clip);
}

double view_height(const Camera &camera) {
    return 2 * glm::length(camera.focal_point - camera.position) * std::tan(camera.view_angle / 2);
}

Camera telecentric(const Camera &camera, double grid_edge) {
    if (!camera.orthographic)
        return camera;
    const double half = view_height(camera) / 2;
    const double distance = std::min(kTelecentricDistance * grid_edge, half / std::tan(kMinTelecentricAngle / 2));
    Camera drawn = camera;
    drawn.position = camera.focal_point - distance * eye_axes(camera).forward;
    drawn.view_angle = 2 * std::atan(half / distance);
    drawn.orthographic = false;
    return drawn;
}

EyeAxes eye_axes(const Camera &camera) {
    assert(is_usable(camera));
    EyeAxes axes{};
    axes.forward = glm::normalize(camera.focal_point - camera.position);
    axes.right = glm::normalize(glm::cross(axes.forward, camera.up));
    axes.up = glm::cross(axes.right, axes.forward);
    return axes;
}

Sphere bounding_sphere(const Grid &grid, std::span<const ByteView> masks, int level) {
    assert(level >= 0 && level <= kBoundsLevel);
    const Sphere sphere = enclose(voxel_corners(masks, level));
    const double edge = grid.voxel_size_at(level);
    return {glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) + edge * sphere.centre, edge * sphere.radius};
}

Sphere bounding_sphere(const Model &model) {
    std::vector<ByteView> masks;
    for (std::size_t level = 0; level < model.levels.size() && level <= kBoundsLevel; ++level)
        masks.emplace_back(model.levels[level].masks);
    return bounding_sphere(model.parameters.grid, masks, static_cast<int>(masks.size()) - 1);
}

glm::dvec3 up_direction(UpAxis up) {
    return up == UpAxis::y ? glm::dvec3(0, 1, 0) : up == UpAxis::z ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
}

glm::dvec3 front_direction(UpAxis up) { return up == UpAxis::z ? glm::dvec3(0, -1, 0) : glm::dvec3(0, 0, 1); }

Camera default_camera(const Model &model, int width, int height, double view_angle) {
    return default_camera(bounding_sphere(model), model.parameters.grid.up, width, height, view_angle);
}

Camera default_camera(const Sphere &bounds, UpAxis up, int width, int height, double view_angle) {
    Camera camera;
    camera.view_angle = view_angle;
    const double vertical = camera.view_angle / 2;
    const double horizontal = std::atan(std::tan(vertical) * width / height);
    camera.focal_point = bounds.centre;
    camera.up = up_direction(up);
    camera.position = bounds.centre + front_direction(up) * bounds.radius / std::sin(std::min(vertical, horizontal));
    return camera;
}

} // namespace pbm
