#include "viewer/pbm-view/window/presenter.h"

#include <epoxy/gl.h>
#include <glm/common.hpp>

#include <cassert>

namespace pbm {

Presenter::Presenter() {
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_edge_);
    glGenTextures(1, &texture_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glGenFramebuffers(1, &framebuffer_);
}

Presenter::~Presenter() {
    glDeleteFramebuffers(1, &framebuffer_);
    glDeleteTextures(1, &texture_);
}

void Presenter::upload(const Framebuffer &picture) {
    assert(picture.width <= max_edge_ && picture.height <= max_edge_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    const glm::ivec2 size(picture.width, picture.height);
    // BGRA is the format of most windows. Between equal formats Mesa's software OpenGL copies in `draw`; for a
    // conversion it compiles shaders, which takes longer than the picture itself.
    if (size != size_)
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, size.x, size.y, 0, GL_BGRA, GL_UNSIGNED_BYTE, nullptr);
    // Rows meet OpenGL's default alignment of 4: a pixel has four bytes.
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size.x, size.y, GL_RGBA, GL_UNSIGNED_BYTE, picture.colour.data());
    size_ = size;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
}

void Presenter::draw(glm::ivec2 size, Rgba8 background) const {
    const auto part = [&](std::size_t channel) { return static_cast<float>(background[channel]) / 255; };
    const glm::ivec2 shown = glm::min(size, size_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glViewport(0, 0, size.x, size.y);
    if (shown != size) {
        glClearColor(part(0), part(1), part(2), 1);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    if (shown == glm::ivec2(0))
        return;
    // A picture's first row is the top one; a framebuffer's is the bottom one.
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
    glBlitFramebuffer(0, 0, shown.x, shown.y, 0, size.y, shown.x, size.y - shown.y, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

} // namespace pbm
