// Text over the picture: what is being loaded, which keys there are, what a frame costs, what was saved where.
#pragma once

#include <glm/vec2.hpp>

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

    // Draws over what is in a framebuffer of `size`.
    void draw(glm::ivec2 size, const OverlayText &text);

  private:
    float scale_;
};

} // namespace pbm
