// The panel of the window: says what the model is and edits shading, lights, materials, palettes and background. What
// the file lacks is named instead of shown.
#pragma once

#include "viewer/pbm-view/window/theme.h"

#include "viewer/pbm-view/light/light_motion.h"
#include "viewer/pbm-view/light/model_notes.h"
#include "viewer/scene/look.h"

#include <glm/vec2.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace pbm {

// What the panel needs to know of a model.
struct PanelModel {
    const ModelParameters *file = nullptr; // must outlive the use of the panel, or until the next model
    const FieldColours *colours = nullptr; // that its points show; null: their own. As long as `file`
    bool has_panorama = false;
    std::uint64_t points = 0; // of the finest level
    Sphere bounds;
    std::string title; // the file's name
    ModelNotes notes;
};

enum class PanelAction { copy_options, save };

class Panel {
  public:
    explicit Panel(Theme theme) : theme_(theme) {}

    // "Reset" restores `first`.
    void show_model(PanelModel model, const Look &first);

    // Width that the panel takes from the right of a window of `size`, so that it does not cover the picture; 0 in a
    // narrow window, over which it floats.
    static int docked_width(glm::ivec2 size, float scale);

    // Builds the panel in a frame of Dear ImGui for a window of `size`; `scale`: the desktop's text scale;
    // `shadows`: says how the shadows of light() stand, empty if there is nothing to say. Returns whether `look` has
    // changed.
    bool build(Look &look, glm::ivec2 size, float scale, const std::string &shadows);

    // The light that the panel shows, and that the raking light moves.
    std::size_t light() const { return light_; }
    Theme theme() const { return theme_; }
    // The button that was pressed since the last call.
    std::optional<PanelAction> take_action();
    // Gives the keyboard to the panel, with its next frame.
    void take_focus() { takes_focus_ = true; }

  private:
    void build_model() const;
    bool build_lights(Look &look, const std::string &shadows);
    bool build_materials(Appearance &appearance);

    PanelModel model_;
    std::optional<Look> first_;
    std::size_t light_ = 0, material_ = 0; // shown
    Theme theme_;
    std::optional<PanelAction> action_;
    bool takes_focus_ = false;
    glm::ivec2 size_{0}; // of the window when the panel was placed
};

} // namespace pbm
