// Draws text (loading, keys, cost of a frame, saved files) and a panel of Dear ImGui over the picture.
#pragma once

#include "viewer/pbm-view/window/window.h"

#include <glm/vec2.hpp>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

struct OverlayRow {
    std::string key, meaning;
};

// Lines and labels over the picture. Places are pixels from the upper left corner.
struct OverlayDrawing {
    struct Line {
        glm::dvec2 from, to;
    };
    struct Label {
        glm::dvec2 place; // of the middle of its left border
        std::string text;
    };
    struct Bar {
        double pixels = 0; // its length; 0: no bar
        std::string text;
    };
    std::vector<Line> lines;
    std::vector<glm::dvec2> marks;
    std::vector<Label> labels;
    Bar bar;             // lower left
    std::string reading; // lower left, below the bar

    bool empty() const {
        return lines.empty() && marks.empty() && labels.empty() && bar.pixels == 0 && reading.empty();
    }
};

// The texts of the cards; a card without text is not shown.
struct OverlayText {
    std::string middle;             // in the middle; replaces the title of the help
    std::optional<double> progress; // 0..1, as a bar under `middle`
    std::string help_title;         // in the middle, over the rows
    std::vector<OverlayRow> help;
    std::string corner; // upper left
    OverlayDrawing drawing;
    std::string status; // at the top: what goes on
    double status_opacity = 1;
    std::string notice; // at the bottom
    bool notice_is_problem = false;

    bool empty() const {
        return middle.empty() && help.empty() && corner.empty() && drawing.empty() && status.empty() && notice.empty();
    }
};

class Overlay {
  public:
    // Every call, including the destructor, needs a current OpenGL 3.2 context. `scale`: the desktop's text scale.
    explicit Overlay(double scale);
    ~Overlay();
    Overlay(const Overlay &) = delete;
    Overlay &operator=(const Overlay &) = delete;

    // Builds windows of Dear ImGui; called within its frame.
    using Build = std::function<void()>;

    // Draws over the contents of a framebuffer of `size`, with the cards over its upper left part `picture`; `panel`
    // may be empty.
    void draw(glm::ivec2 size, glm::ivec2 picture, const OverlayText &text, const Build &panel);

    // Both take effect with the next frame.
    bool set_light_theme(bool light); // whether that is new
    void set_scale(double scale);

    // Records input for the next `update`. Pixels from the upper left corner.
    void point(glm::dvec2 pixels);
    void handle(const ButtonEvent &event);
    void handle(const WheelEvent &event);
    void handle(const EditEvent &event);
    void handle(const CharacterEvent &event);
    // Passes input to the panel without drawing. The panel's changes are made when this returns.
    void update(glm::ivec2 size, const Build &panel);
    // Whether the panel takes the mouse, or the keys, as of the last update.
    bool wants_mouse() const;
    bool wants_keys() const;
    // Whether a list of the panel is open.
    bool has_popup() const;
    // Takes the keyboard from the panel.
    void release_keys();

  private:
    void begin_frame(glm::ivec2 size);

    void set_style();

    float scale_;
    bool light_ = false;
    double last_frame_ = 0; // window's clock
};

} // namespace pbm
