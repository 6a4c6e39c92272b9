// Handles by which a user drags a clip region in a picture.
//
//   plane  the dot at its point moves it along its normal; the dot at the tip of its normal turns it
//   box    the dot in the middle of each face moves that face
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/framing.h"
#include "viewer/pbm-view/measure/picture_space.h"

#include <array>
#include <optional>
#include <vector>

namespace pbm {

// Faces of the box: those with the least and the greatest x, y and z.
enum class ClipHandle { plane, normal, least_x, most_x, least_y, most_y, least_z, most_z };

struct HandlePlace {
    ClipHandle handle;
    glm::dvec3 place; // model space
};

// A plane through the middle of the model. It cuts away the half nearer to the eye, across the axis of model space that
// is nearest to the line of sight.
ClipPlane first_clip_plane(const Camera &camera, const Sphere &bounds);
// A box around the model.
ClipBox first_clip_box(const Sphere &bounds);

// `radius`: of the model's bounding sphere, which gives the length of the plane's normal.
std::vector<HandlePlace> clip_handles(const ClipRegion &region, double radius);
// Outline of the plane, a circle, with its normal; edges of the box.
std::vector<std::array<glm::dvec3, 2>> clip_outline(const ClipRegion &region, double radius);

// The handle nearest to a pixel, at most `reach` pixels from it.
std::optional<ClipHandle> handle_at(const std::vector<HandlePlace> &handles, const PictureSpace &space,
                                    glm::dvec2 pixel, double reach);

// The region once `handle`, which is one of its own, was dragged to a pixel. A box keeps a thousandth of `radius`
// between opposite faces. Where the mouse says nothing, as along a line of sight, the region stays as it is.
ClipRegion after_handle_drag(ClipRegion region, ClipHandle handle, double radius, const PictureSpace &space,
                             glm::dvec2 pixel);

} // namespace pbm
