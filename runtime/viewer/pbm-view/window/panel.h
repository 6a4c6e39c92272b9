// The panel of the window: edits shading, lights, materials, palettes and background. What the file lacks is greyed
// out.
#pragma once

#include "viewer/scene/look.h"

#include <glm/vec2.hpp>

#include <optional>

namespace pbm {

class Panel {
  public:
    // `file` must outlive the use of the panel, or until the next call. "Reset" restores `first`.
    void show_model(const ModelParameters &file, bool has_panorama, const Look &first);

    // Builds the panel in a frame of Dear ImGui for a window of `size`; `scale`: the desktop's text scale. Returns
    // whether `look` has changed.
    bool build(Look &look, glm::ivec2 size, float scale);

  private:
    const ModelParameters *file_ = nullptr;
    bool has_panorama_ = false;
    std::optional<Look> first_;
    glm::ivec2 size_{0}; // of the window when the panel was placed
};

} // namespace pbm
