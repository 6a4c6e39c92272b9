// Cameras that see all of a model: the default camera of every program, and those of other directions.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/extent.h"

namespace pbm {

// A framed model reaches to this part of the way from the picture's middle to its border, along the axis on which it
// reaches farther.
inline constexpr double kFramedPart = 0.95;

// Moves the camera, without turning it, so that the projection of the extent is centred in a picture of this size and
// as large as kFramedPart allows. The focal point lies in front of the camera, as far as the centre of the sphere.
Camera framed(const Camera &direction, const Extent &extent, int width, int height);

// The first view: level, from the front (front_direction), framed. Models whose height along the up axis is less than a
// third of their length, as terrain is, are seen from 30 degrees above.
Camera default_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);
Camera default_camera(const Model &model, int width, int height, double view_angle = kDefaultViewAngle);

// The same direction, framed so that the model stays in the picture while it turns about the up axis. The focal point
// lies on the axis through the centre of the sphere.
Camera turntable_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);

// Looks from the front at a sphere, which touches the nearer borders of the picture.
Camera camera_around(const Sphere &sphere, UpAxis up, int width, int height, double view_angle = kDefaultViewAngle);

} // namespace pbm
