#include "viewer/pbm-view/measure/picture_space.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>

namespace pbm {

PictureSpace::PictureSpace(const Camera &camera, double grid_edge, glm::ivec2 size)
    : projection_(telecentric(camera, grid_edge), size.x, size.y),
      focal_depth_(glm::dot(camera.focal_point - projection_.eye, projection_.axes.forward)) {}

glm::dvec3 PictureSpace::point(glm::dvec2 pixel, double depth) const {
    return projection_.eye + projection_.ray(pixel) * depth;
}

PictureSpace::Place PictureSpace::place(const glm::dvec3 &point) const {
    const glm::dvec3 screen = projection_.point(point);
    return {glm::dvec2(screen) / screen.z, screen.z};
}

std::optional<PictureSpace::Image> PictureSpace::image(glm::dvec3 from, glm::dvec3 to) const {
    const double nearest = 1e-3 * focal_depth_;
    const double first = place(from).depth, last = place(to).depth;
    if (first < nearest && last < nearest)
        return std::nullopt;
    const glm::dvec3 cut = glm::mix(from, to, (nearest - first) / (last - first)); // not used if both are in front
    return Image{place(first < nearest ? cut : from).pixel, place(last < nearest ? cut : to).pixel};
}

std::optional<PickedPoint> pick(const Framebuffer &picture, const PictureSpace &space, glm::ivec2 pixel) {
    if (picture.depth.empty() || pixel.x < 0 || pixel.y < 0 || pixel.x >= picture.width || pixel.y >= picture.height)
        return std::nullopt;
    const double depth =
        static_cast<double>(picture.depth[static_cast<std::size_t>(std::ptrdiff_t{pixel.y} * picture.width + pixel.x)]);
    if (!std::isfinite(depth))
        return std::nullopt;
    return PickedPoint{space.point(glm::dvec2(pixel) + 0.5, depth), depth};
}

} // namespace pbm
