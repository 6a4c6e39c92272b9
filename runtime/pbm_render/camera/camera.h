// The camera. Model space is right-handed; angles are radians.
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

// Keeps the side that the normal leads to.
struct ClipPlane {
    glm::dvec3 point{0};
    glm::dvec3 normal{0, 0, 1}; // not zero, of any length
    bool operator==(const ClipPlane &) const = default;
};

// Along the axes; keeps what lies inside.
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

    // How a box along the axes lies to the region. `cut`: some of it may be inside.
    enum class Side { outside, cut, inside };
    Side side_of(const glm::dvec3 &centre, const glm::dvec3 &half_edges) const;

  private:
    std::array<HalfSpace, kMax> half_spaces_;
    std::size_t count_ = 0;
};

// Whether points that face away from the eye are drawn. automatic: unless the file says that its surface is closed, the
// camera has no clip region, and the eye lies outside of the grid's cube; then no back can be seen.
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
// Height of what a usable camera sees of the focal point's plane, model units.
double view_height(const Camera &camera);

// The pinhole camera that draws the picture of an orthographic one; a pinhole is returned as it is. It stands
// kTelecentricDistance edges of the grid behind the focal point, nearer if its angle would be less than
// kMinTelecentricAngle, and sees as much of the focal point's plane. What lies z edges before or behind this plane is
// drawn too large or too small by z / kTelecentricDistance: half a grid away from the plane and at the border of a
// picture of 720 rows, 0.35 pixels. Renderers and select_detail call it; who turns depths into places needs it, too.
Camera telecentric(const Camera &camera, double grid_edge);

// Up and front directions in model space. The default camera stands in front: +Z for Y up, -Y for Z up, +Z for X up.
glm::dvec3 up_direction(UpAxis up);
glm::dvec3 front_direction(UpAxis up);
// Of an eye that looks level at the front.
EyeAxes front_axes(UpAxis up);

} // namespace pbm
