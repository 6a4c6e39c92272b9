// Memory of a picture that is no longer shown, for the next one: to touch new pages takes longer than a fast picture.
#pragma once

#include "pbm_render/picture/framebuffer.h"

#include <glm/vec2.hpp>

#include <mutex>
#include <optional>
#include <utility>

namespace pbm {

// Its functions may be called by any thread.
class PictureMemory {
  public:
    // A picture of this size with depths; its pixels are not defined.
    Framebuffer take(glm::ivec2 size) {
        {
            const std::lock_guard lock(mutex_);
            auto kept = std::exchange(kept_, std::nullopt);
            if (kept && glm::ivec2(kept->width, kept->height) == size)
                return std::move(*kept);
        }
        return Framebuffer(size.x, size.y);
    }
    // Keeps the last one.
    void give(Framebuffer picture) {
        if (picture.colour.empty())
            return;
        const std::lock_guard lock(mutex_);
        kept_ = std::move(picture);
    }

  private:
    std::mutex mutex_; // guards
    std::optional<Framebuffer> kept_;
};

} // namespace pbm
