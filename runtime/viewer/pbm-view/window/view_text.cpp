#include "viewer/pbm-view/window/view_text.h"

#include <array>
#include <cstdio>
#include <filesystem>

namespace pbm {
namespace {

std::string size_text(glm::ivec2 size) { return std::to_string(size.x) + "x" + std::to_string(size.y); }

std::string pixels(double error) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f pixels", error);
    return text.data();
}

std::string levels(const PictureStatistics &picture) {
    const std::string finest = std::to_string(picture.drawn.level);
    return picture.coarsest_level == picture.drawn.level
               ? "level " + finest
               : "levels " + std::to_string(picture.coarsest_level) + " to " + finest;
}

} // namespace

std::string grouped(std::uint64_t number) {
    const std::string digits = std::to_string(number);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && (digits.size() - i) % 3 == 0)
            text += ',';
        text += digits[i];
    }
    return text;
}

std::string file_name(const std::string &path) { return std::filesystem::path(path).filename().string(); }

std::string milliseconds(double seconds) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.1f ms", 1e3 * seconds);
    return text.data();
}

std::vector<OverlayRow> help_rows(CameraMode mode) {
    std::vector<OverlayRow> rows;
    if (mode == CameraMode::orbit)
        rows = {{"Drag, Left, Right", "turn the model"},
                {"Wheel", "zoom to the mouse"},
                {"Right drag, Up, Down", "change the distance"}};
    else
        rows = {{"Drag", "turn the camera"},
                {"Wheel", "fly to what is under the mouse, and back"},
                {"Up, Down", "fly along the view direction"},
                {"Left, Right", "fly sideways"}};
    const std::vector<OverlayRow> common{{"Middle drag, Shift + drag", "move the model in the picture"},
                                         {"W, A, S, D", "as the arrow keys"},
                                         {"Double click", "what is under the mouse moves to the middle"},
                                         {"F", "show the whole model"},
                                         {"Enter", "back to the first view"},
                                         {"1, 2, 3, 4", "from the front, the right, above, a corner"},
                                         {"5", "orthographic or perspective"},
                                         {"B", "show or hide backs: hidden, rooms are seen into from outside"},
                                         {"Ctrl + 6 to 9; 6 to 9", "save a view; show it"},
                                         {"M", "measure: clicks set points; Backspace, Delete: one, all back"},
                                         {"X", "coordinates under the mouse"},
                                         {"K", "cut the model open: a plane, a box"},
                                         {"U", "another up axis"},
                                         {"I", "light: automatic, lit, colours alone"},
                                         {"N", "other colours: fields, height, normal, plain"},
                                         {"C", mode == CameraMode::orbit ? "flying camera" : "target camera"},
                                         {"Space, F12", "save a picture"},
                                         {"Tab", "model, lights, materials, shading"},
                                         {"F6", "keyboard to the panel, and back"},
                                         {"L + drag", "light from where the pointer is"},
                                         {"Ctrl + C", "copy the command for this picture, or what is measured"},
                                         {"Ctrl + S", "save lights, materials and view"},
                                         {"F1, H", "this help"},
                                         {"F2", "what a picture costs"},
                                         {"F11", "full screen"},
                                         {"Ctrl + O, drop files", "open models, scans or folders"},
                                         {"Page Up, Page Down", "previous, next file"},
                                         {"Ctrl + R", "recent files; what is wrong with a file"},
                                         {"Escape", "one step back: from a drag, a tool, the panel; quit"}};
    rows.insert(rows.end(), common.begin(), common.end());
    return rows;
}

std::string cost_text(const PictureStatistics &picture, int depth, glm::ivec2 size) {
    return milliseconds(picture.seconds) + "   " + pixels(picture.error) + "   " + levels(picture) + " of " +
           std::to_string(depth) + "   " + grouped(picture.drawn.drawn_points) + " of " +
           grouped(picture.drawn.points) + " points   " + size_text(size);
}

std::string cost_line(const PictureStatistics &picture, int depth, glm::ivec2 size, const StreamingStatistics &loaded) {
    return "error " + pixels(picture.error) + ", " + levels(picture) + " of " + std::to_string(depth) + ", " +
           std::to_string(picture.drawn.drawn_points) + " of " + std::to_string(picture.drawn.points) +
           " points drawn, " + milliseconds(picture.seconds) + ", " + size_text(size) + ", " +
           std::to_string(loaded.bytes_read) + " bytes read, " + std::to_string(loaded.points_decoded) +
           " points decoded, ";
}

} // namespace pbm
