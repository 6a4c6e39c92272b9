// What a renderer asks of the surroundings. It needs no more of them than this, so that a program that draws the object
// alone links none of what samples ground plane and panorama.
// Stability: experimental.
#pragma once

#include "pbm_render/picture/framebuffer.h"

#include <glm/vec3.hpp>

#include <memory>

namespace pbm {

struct Appearance;
struct Projection; // pbm_render/camera/projection.h
struct RenderOptions;

// The surroundings in one frame.
class FrameSurroundings {
  public:
    virtual ~FrameSurroundings() = default;

    // Whether materials mirror a panorama: there is one, and the options allow it.
    virtual bool has_reflections() const = 0;
    // The panorama's light along a direction (model axes, any length), filtered over an angle (radians): linear red,
    // green, blue and 0. Expects has_reflections().
    virtual Float4 reflection(glm::vec3 direction, float footprint) const = 0;

    // Draws the surroundings behind the object, whose depths `target` has in multiples of `edge`: +infinity marks a
    // pixel without object. Writes colours, and the depth of the ground plane where it covers at least half a pixel.
    virtual void draw_behind(Framebuffer &target, float edge) const = 0;
};

// The surroundings of a model.
class ModelSurroundings {
  public:
    virtual ~ModelSurroundings() = default;
    // `projection` takes the unit grid to the screen. All arguments must outlive the result.
    virtual std::unique_ptr<const FrameSurroundings>
    in_frame(const Appearance &appearance, const Projection &projection, const RenderOptions &options) const = 0;
};

} // namespace pbm
