// Over the picture: text (what is being loaded, which keys there are, what a frame costs, what was saved where), and a
// panel of Dear ImGui, which gets its input here.
#pragma once

#include "window/window.h"

#include <glm/vec2.hpp>

#include <functional>
#include <string>
#include <vector>

namespace pbm {

struct OverlayRow {
    std::string key, meaning;
};

// Every card is shown if it has text.
struct OverlayText {
    std::string middle;     // in the middle; while there is help, in place of its title
    std::string help_title; // in the middle, over the rows
    std::vector<OverlayRow> help;
    std::string corner; // upper left
    std::string notice; // at the bottom
    bool notice_is_problem = false;

    bool empty() const { return middle.empty() && help.empty() && corner.empty() && notice.empty(); }
};

class Overlay {
  public:
    // Needs a current OpenGL 3.2 context, here and in every call, the destructor too. `scale`: of the desktop's text.
    explicit Overlay(double scale);
    ~Overlay();
    Overlay(const Overlay &) = delete;
    Overlay &operator=(const Overlay &) = delete;

    // Builds windows of Dear ImGui within its frame.
    using Build = std::function<void()>;

    // Draws over what is in a framebuffer of `size`; `panel` may be empty.
    void draw(glm::ivec2 size, const OverlayText &text, const Build &panel);

    // Input, to be followed by `update`. Pixels from the upper left corner.
    void point(glm::dvec2 pixels);
    void handle(const ButtonEvent &event);
    void handle(const WheelEvent &event);
    void handle(const EditEvent &event);
    void handle(const CharacterEvent &event);
    // Lets the panel have the input without drawing: what it changes is changed when this returns.
    void update(glm::ivec2 size, const Build &panel);
    // Whether mouse, or keys, are the panel's, as of the last update.
    bool wants_mouse() const;
    bool wants_keys() const;

  private:
    void begin_frame(glm::ivec2 size);

    float scale_;
    double last_frame_ = 0; // window's clock
};

} // namespace pbm
