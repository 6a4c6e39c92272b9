// Which point of model space a pixel of a picture shows, and where a point lies in the picture.
#pragma once

#include "pbm_render/camera/projection.h"
#include "pbm_render/picture/framebuffer.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>

namespace pbm {

// The space that a picture of `size` pixels shows. Pixel (x, y) has its centre at (x + 0.5, y + 0.5). All in doubles:
// places are exact to parts of a voxel at coordinates of millions, too.
class PictureSpace {
  public:
    // `camera` is usable and may be orthographic; `grid_edge`: of the model's grid.
    PictureSpace(const Camera &camera, double grid_edge, glm::ivec2 size);

    // The point at this depth of the framebuffer.
    glm::dvec3 point(glm::dvec2 pixel, double depth) const;
    // A point in the picture. It lies behind the eye if its depth is not positive; then `pixel` says nothing.
    struct Place {
        glm::dvec2 pixel;
        double depth;
    };
    Place place(const glm::dvec3 &point) const;
    // The image of a line, as far as it lies in front of the eye; absent if all of it lies behind.
    struct Image {
        glm::dvec2 from, to;
    };
    std::optional<Image> image(glm::dvec3 from, glm::dvec3 to) const;

    double focal_depth() const { return focal_depth_; }
    // Edge of a pixel at this depth, model units.
    double pixel_size(double depth) const { return depth / projection_.focal; }

  private:
    Projection projection_;
    double focal_depth_;
};

// A point of the surface that a picture shows.
struct PickedPoint {
    glm::dvec3 place;
    double depth;
};

// What pixel (x, y) shows of the surface or the ground: the point where its ray meets the plane of the splat. Absent
// outside the picture, where it shows the background, and if the picture has no depths.
std::optional<PickedPoint> pick(const Framebuffer &picture, const PictureSpace &space, glm::ivec2 pixel);

} // namespace pbm
