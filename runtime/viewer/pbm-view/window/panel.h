// The panel of the window: every switch of the shading, lights, materials, palettes and the background, to be changed
// while looking. What the file does not have is greyed out.
#pragma once

#include "viewer/scene/look.h"

#include <glm/vec2.hpp>

#include <optional>

namespace pbm {

class Panel {
  public:
    // `file` must stay until the next call. `first`: what "Reset" goes back to.
    void show_model(const ModelParameters &file, bool has_panorama, const Look &first);

    // Builds the panel within a frame of Dear ImGui, for a window of `size`; `scale`: of the desktop's text. Whether
    // `look` was changed.
    bool build(Look &look, glm::ivec2 size, float scale);

  private:
    bool build_switches(RenderOptions &options) const;
    bool build_quality(LookOptions &options) const;
    bool build_lights(Appearance &appearance) const;
    bool build_light(Light &light, std::size_t index, std::size_t count) const;
    bool build_direction(Light &light) const;
    bool build_materials(Appearance &appearance) const;
    bool build_palettes(Appearance &appearance) const;

    const ModelParameters *file_ = nullptr;
    bool has_panorama_ = false;
    std::optional<Look> first_;
    glm::ivec2 size_{0}; // of the window it was placed for
};

} // namespace pbm
