// The card that opens files: what is wrong with the last file, the open dialog, recent files. Keyboard and mouse.
#pragma once

#include "viewer/opening/explanation.h"

#include <glm/vec2.hpp>

#include <optional>
#include <string>
#include <vector>

namespace pbm {

class StartPage {
  public:
    struct Problem {
        std::string file; // may be empty
        Explanation explanation;
    };
    // What the user has chosen: a file, or the open dialog if the path is empty.
    struct Choice {
        std::string path;
    };

    void show(std::vector<std::string> recent);
    void hide() { shown_ = false; }
    bool is_shown() const { return shown_; }
    // The problem that the page describes until the next one.
    void set_problem(std::optional<Problem> problem);

    // Moves the selection, round at the ends.
    void move(int rows);
    // Takes the selected row: a choice, or none where it opens or closes the details of the problem.
    std::optional<Choice> take();
    // Builds the card in a frame of Dear ImGui for a window of `size`; `scale`: the desktop's text scale;
    // `over_model`: at its lower edge. Returns what the mouse has chosen.
    std::optional<Choice> build(glm::ivec2 size, float scale, bool over_model);

  private:
    int rows() const { return (has_details() ? 1 : 0) + 1 + static_cast<int>(recent_.size()); }
    bool has_details() const { return problem_ && !problem_->explanation.details.empty(); }

    bool shown_ = false, details_ = false;
    std::optional<Problem> problem_;
    std::vector<std::string> recent_;
    int selected_ = 0;
};

} // namespace pbm
