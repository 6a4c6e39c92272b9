#include "pbm_render/camera.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr int kCentreLevel = 5; // about 1,500 voxels: enough to find the centre
constexpr int kRadiusLevel = 8; // half a diagonal is then 0.3 % of the cube's edge
constexpr std::size_t kMaxNodes = std::size_t{1} << (3 * kRadiusLevel);

glm::dvec3 voxel_centre(MortonCode code) {
    const auto [x, y, z] = morton_decode(code);
    return glm::dvec3(x, y, z) + 0.5;
}

// Voxels of the deepest level there is, but not below `max_level`.
std::vector<MortonCode> occupied_voxels(const Model &model, int max_level, int &level) {
    std::vector<MortonCode> codes{0};
    for (level = 0; level < max_level && static_cast<std::size_t>(level) + 1 < model.levels.size(); ++level) {
        auto below = expand_level(codes, model.levels[static_cast<std::size_t>(level) + 1].masks, kMaxNodes);
        assert(below.ok());
        codes = std::move(*below);
    }
    return codes;
}

glm::dvec3 farthest(const std::vector<glm::dvec3> &points, glm::dvec3 from) {
    return *std::max_element(points.begin(), points.end(), [&](const glm::dvec3 &a, const glm::dvec3 &b) {
        return glm::dot(a - from, a - from) < glm::dot(b - from, b - from);
    });
}

} // namespace

bool is_usable(const Camera &camera) {
    const glm::dvec3 sight = camera.focal_point - camera.position;
    const double turn = glm::length(glm::cross(sight, camera.up));
    return std::isfinite(turn) && turn > 1e-9 * glm::length(sight) * glm::length(camera.up) &&
           camera.view_angle > 1e-6 && camera.view_angle < 3.14;
}

EyeAxes eye_axes(const Camera &camera) {
    assert(is_usable(camera));
    EyeAxes axes{};
    axes.forward = glm::normalize(camera.focal_point - camera.position);
    axes.right = glm::normalize(glm::cross(axes.forward, camera.up));
    axes.up = glm::cross(axes.right, axes.forward);
    return axes;
}

Sphere bounding_sphere(const Model &model) {
    int level = 0;
    std::vector<glm::dvec3> points;
    for (const MortonCode code : occupied_voxels(model, kCentreLevel, level))
        points.push_back(voxel_centre(code) / std::ldexp(1.0, level));
    // Walks towards the farthest voxel in shrinking steps: converges to the centre of the smallest sphere.
    glm::dvec3 centre = points.front();
    double step = 0.5;
    for (int i = 0; i < 250; ++i, step *= 0.97)
        centre += step * (farthest(points, centre) - centre);

    double radius = 0; // of voxel centres, in units of the cube's edge
    for (const MortonCode code : occupied_voxels(model, kRadiusLevel, level))
        radius = std::max(radius, glm::length(voxel_centre(code) / std::ldexp(1.0, level) - centre));
    radius += std::sqrt(0.75) / std::ldexp(1.0, level);

    const Grid &grid = model.parameters.grid;
    return {glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) + grid.edge() * centre, grid.edge() * radius};
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
