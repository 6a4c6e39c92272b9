// The legend of a picture whose points have the colours of a field, of heights or of normals: a bar with the range, or
// a row for each label.
#pragma once

#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/appearance/hidden_classes.h"
#include "pbm_render/picture/framebuffer.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

struct Legend {
    struct Row {
        Rgb8 colour;
        std::string text;
    };
    std::string title;                  // name and unit of the field
    std::vector<Row> rows;              // of labels or axes; empty: a bar
    std::array<Rgb8, 255> bar{};        // from the least to the greatest value
    std::array<std::string, 3> ticks{}; // at its ends and its middle, from the least on
};

// None of plain colours. Classes that are `hidden` have no row.
std::optional<Legend> legend_of(const FieldColours &colours, const HiddenClasses *hidden = nullptr);

// Draws the legend into the upper right corner, in the size of text that the picture's height suggests; not at all
// where it would cover a third of the picture or more. Letters beyond ASCII are drawn as question marks.
void draw_legend(const Legend &legend, Framebuffer &target);

// Draws a bar of `pixels` with a text above it into the lower left corner, black or white, whichever the picture there
// shows better. `letter`: the height of capitals, pixels; 0: as the picture's height suggests.
void draw_bar(int pixels, const std::string &text, int letter, Framebuffer &target);

} // namespace pbm
