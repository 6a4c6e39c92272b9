// Copies a picture to the window's framebuffer through a texture, pixel for pixel, without any conversion.
#pragma once

#include "pbm_render/picture/framebuffer.h"

#include <glm/vec2.hpp>

namespace pbm {

class Presenter {
  public:
    // Every call, including the destructor, needs a current OpenGL 3.2 context.
    Presenter();
    ~Presenter();
    Presenter(const Presenter &) = delete;
    Presenter &operator=(const Presenter &) = delete;

    // Longest edge of a picture that can be shown.
    int max_edge() const { return max_edge_; }
    void upload(const Framebuffer &picture);
    // Draws the picture, if any, into the upper left corner of a window of `size`; fills the rest with `background`.
    void draw(glm::ivec2 size, Rgba8 background) const;

  private:
    unsigned texture_ = 0, framebuffer_ = 0; // OpenGL names
    int max_edge_ = 0;
    glm::ivec2 size_{0};
};

} // namespace pbm
