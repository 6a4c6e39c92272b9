// A camera of another program, and how it moves: the nodes above it and their animations.
#pragma once

#include "pbm_render/camera/framing.h"
#include "viewer/cameras/keyframes.h"
#include "viewer/options/view_options.h"

#include <glm/mat4x4.hpp>

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

struct Lens {
    bool orthographic = false;
    double size = 0;   // vertical angle of view, radians; orthographic: half the height that is seen
    double aspect = 0; // width by height of the picture; 0: any
    double nearest = 0, farthest = std::numeric_limits<double>::infinity(); // of what is seen, along the view
    std::optional<Keyframes> zoom{};                                        // `size` as it changes
};

// A node of a scene: where its children lie.
struct PathNode {
    glm::dmat4 matrix{1};                           // if none of the three is given
    std::array<glm::dvec4, 3> rest{};               // translation, rotation (a quaternion), scale
    std::array<std::optional<Keyframes>, 3> keys{}; // of these
    bool has_parts = false;                         // these are given, and `matrix` is not
};

struct CameraPath {
    std::string name;
    Lens lens;
    std::vector<PathNode> nodes;  // from the root of the scene to the camera
    double begin = 0, end = 0;    // seconds; equal: nothing moves
    std::optional<double> rate{}; // keys a second, if they are evenly spaced as those of film are
};

// Frames of the whole path, at `fps` a second.
int frame_count(const CameraPath &path, double fps);
// The time of a frame, from 1.
double frame_time(const CameraPath &path, int frame, double fps);

// The view of the camera at that time: position, focal point, up vector, angle and projection, and a clip plane where
// the lens cuts something off and `view` has none. The camera's y axis becomes `up`. `extent`: of the model; the focal
// point lies as far away as its middle, if that lies in front of the camera.
ViewOptions view_at(const CameraPath &path, double time, const Extent &extent, UpAxis up, ViewOptions view);

} // namespace pbm
