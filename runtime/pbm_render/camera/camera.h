// The camera. Model space is right-handed; angles are radians.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace pbm {

inline constexpr double kDefaultViewAngle = 0.5235987755982988; // 30 degrees

// A clip plane: the half-space that `normal` points into stays visible.
struct ClipPlane {
    glm::dvec3 point{0};
    glm::dvec3 normal{0, 0, 1}; // not zero, of any length
    bool operator==(const ClipPlane &) const = default;
};

// An axis-aligned clip box: its inside stays visible.
struct ClipBox {
    glm::dvec3 least{0}, most{0};
    bool operator==(const ClipBox &) const = default;
};

// A plane and a box that cut a model open: a picture shows only the points on the inner side of both.
struct ClipRegion {
    std::optional<ClipPlane> plane;
    std::optional<ClipBox> box;

    bool empty() const { return !plane && !box; }
    bool operator==(const ClipRegion &) const = default;
};

// The points p with dot(normal, p) + offset >= 0; the normal has length 1.
struct HalfSpace {
    glm::dvec3 normal;
    double offset;
};

// The half-spaces whose intersection is a region; none for all of space.
class HalfSpaces {
  public:
    static constexpr std::size_t kMax = 7; // six of a box, one of a plane

    explicit HalfSpaces(const ClipRegion &region);
    std::span<const HalfSpace> all() const { return std::span(half_spaces_).first(count_); }
    bool empty() const { return count_ == 0; }

    // Where an axis-aligned box lies relative to the region. `cut`: part of the box may be inside.
    enum class Side { outside, cut, inside };
    Side side_of(const glm::dvec3 &centre, const glm::dvec3 &half_edges) const;

  private:
    std::array<HalfSpace, kMax> half_spaces_;
    std::size_t count_ = 0;
};

// Whether points that face away from the eye are drawn. `automatic` hides them where none can be visible: the file says
// that its surface is closed, the camera has no clip region, and the eye lies outside the grid's cube.
enum class Backs : std::uint8_t { automatic, show, hide };

// A camera as users of F3D and VTK describe it: a pinhole, or an orthographic camera that sees as much of the focal
// point's plane as the pinhole would.
struct Camera {
    glm::dvec3 position{0, 0, 1};          // model space
    glm::dvec3 focal_point{0};             // model space, the middle of the picture
    glm::dvec3 up{0, 1, 0};                // any length, not along the line of sight
    double view_angle = kDefaultViewAngle; // vertical, radians
    bool orthographic = false;             // drawn by a telecentric camera, see telecentric()
    ClipRegion clip{};                     // model space; empty: the whole model. What lies outside is not drawn
    Backs backs = Backs::automatic;
    bool has_round_points = false; // the model has some (BVG.md 18): in_unit_grid knows
    bool operator==(const Camera &) const = default;
};

// Distance between focal point and eye of a telecentric camera, in edges of the grid. Depths are floats: at this
// distance they resolve 1/32768 of the edge.
inline constexpr double kTelecentricDistance = 511;
// Smallest vertical angle of a telecentric camera, radians.
inline constexpr double kMinTelecentricAngle = 2e-6;

// Orthonormal axes of the eye in model space.
struct EyeAxes {
    glm::dvec3 right, up, forward;
};

// False if the camera has no line of sight: position and focal point coincide, `up` lies along the view, a value is not
// finite, the angle is outside 0..180 degrees, or the normal of `clip` is zero.
bool is_usable(const Camera &camera);
// Needs a usable camera.
EyeAxes eye_axes(const Camera &camera);
// Height of the visible part of the focal point's plane, model units. Needs a usable camera.
double view_height(const Camera &camera);

// Returns the pinhole camera that stands in for an orthographic camera; returns a pinhole camera unchanged. The result
// stands kTelecentricDistance grid edges behind the focal point, nearer if its angle would be less than
// kMinTelecentricAngle, and sees the same part of the focal point's plane. A point z grid edges away from this plane is
// drawn with a relative error of z / kTelecentricDistance: 0.35 pixels for z = 1/2 at the border of a picture of 720
// rows. Renderers and select_detail call this function. Code that converts depths to positions must call it, too.
Camera telecentric(const Camera &camera, double grid_edge);

// Up and front directions in model space. The default camera stands in front: +Z for Y up, -Y for Z up, +Z for X up.
glm::dvec3 up_direction(UpAxis up);
glm::dvec3 front_direction(UpAxis up);
// Axes of an eye that looks horizontally at the model's front.
EyeAxes front_axes(UpAxis up);

} // namespace pbm
