#include "pbm_render/camera/unit_grid.h"

#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {

Grid unit_grid(const Grid &grid) {
    return {.depth = grid.depth,
            .origin = {},
            .voxel_size = std::ldexp(1.0, -grid.depth),
            .unit = grid.unit,
            .up = grid.up};
}

bool shows_backs(const Camera &camera, const ModelParameters &parameters) {
    if (camera.backs != Backs::automatic)
        return camera.backs == Backs::show;
    if (!parameters.closed || !camera.clip.empty())
        return true;
    const Grid &grid = parameters.grid;
    const glm::dvec3 in_cube =
        (camera.position - glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2])) / grid.edge();
    return !camera.orthographic && glm::all(glm::greaterThanEqual(in_cube, glm::dvec3(0))) &&
           glm::all(glm::lessThanEqual(in_cube, glm::dvec3(1)));
}

Camera in_unit_grid(const Camera &camera, const ModelParameters &parameters) {
    const Grid &grid = parameters.grid;
    const glm::dvec3 origin(grid.origin[0], grid.origin[1], grid.origin[2]);
    Camera result = camera;
    result.position = (camera.position - origin) / grid.edge();
    result.focal_point = (camera.focal_point - origin) / grid.edge();
    if (result.clip.plane)
        result.clip.plane->point = (camera.clip.plane->point - origin) / grid.edge();
    if (result.clip.box)
        result.clip.box = {(camera.clip.box->least - origin) / grid.edge(),
                           (camera.clip.box->most - origin) / grid.edge()};
    result.backs = shows_backs(camera, parameters) ? Backs::show : Backs::hide;
    result.has_round_points = std::any_of(parameters.materials.begin(), parameters.materials.end(), is_round);
    return telecentric(result, 1);
}

} // namespace pbm
