#include "pbm_render/picture/framebuffer.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace pbm {

Framebuffer::Framebuffer(int w, int h, bool with_depths)
    : width(w),
      height(h), limits{static_cast<float>(w), static_cast<float>(w), static_cast<float>(h), static_cast<float>(h)},
      colour(pixels() + (with_depths ? static_cast<std::size_t>(w) + 1 : 0)), depth(with_depths ? colour.size() : 0) {
    assert(w >= 1 && h >= 1 && w <= kMaxPictureEdge && h <= kMaxPictureEdge);
    if (with_depths)
        clear({});
}

Framebuffer::~Framebuffer() = default;
Framebuffer::Framebuffer(const Framebuffer &) = default;
Framebuffer::Framebuffer(Framebuffer &&) noexcept = default;
Framebuffer &Framebuffer::operator=(const Framebuffer &) = default;
Framebuffer &Framebuffer::operator=(Framebuffer &&) noexcept = default;

void Framebuffer::clear(Rgba8 background) {
    std::fill(colour.begin(), colour.end(), pack_rgba(background));
    std::fill(depth.begin(), depth.end(), std::numeric_limits<float>::infinity());
}

} // namespace pbm
