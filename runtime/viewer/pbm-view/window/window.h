// A window with an OpenGL context, and its input events. The only user of GLFW.
#pragma once

#include "system/error.h"

#include <glm/vec2.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

struct GLFWwindow;

namespace pbm {

enum class Key {
    left,
    right,
    up,
    down,
    save,
    reset,
    up_axis,
    colours,
    shading,
    switch_camera,
    help,
    frame_time,
    panel,
    full_screen,
    quit,
    fit,
    backs,
    digit,
    control_digit,
    measure,
    coordinates,
    clip,
    copy,
    open_dialog,
    start_page,
    previous_file,
    next_file,
    light,
    panel_focus,
    save_scene,
};
// Keys that edit a text field or move through the panel, in the order of kKeys of overlay.cpp.
enum class EditKey { backspace, erase, enter, cancel, left, right, home, end, up, down, tab, space };
enum class MouseButton { left, middle, right };

struct KeyEvent {
    Key key;
    bool pressed; // false: released. Key repeats are left out.
    int digit;    // 0..9, of the keys named so
};
struct ButtonEvent {
    MouseButton button;
    bool pressed;
    bool shift, control;
};
struct EditEvent {
    EditKey key;
    bool pressed; // true for key repeats
};
struct CharacterEvent {
    std::uint32_t character; // Unicode
};
struct MoveEvent {
    glm::dvec2 position; // picture heights from the upper left corner, down positive
};
struct WheelEvent {
    double notches; // positive: away from the user
};
struct DropEvent {
    std::vector<std::string> paths; // at least one
};
// The window's content is lost, or its size has changed.
struct RefreshEvent {};

using Event =
    std::variant<KeyEvent, EditEvent, CharacterEvent, ButtonEvent, MoveEvent, WheelEvent, DropEvent, RefreshEvent>;

class Window {
  public:
    // Opens a window of `size` pixels and makes its OpenGL 3.2 core context current on this thread; software GL offers
    // 3.2. `scaled`: times the scale of the desktop. Only one window may exist.
    //
    // errors  memory (exit code 4)  there is no display, or no such OpenGL
    static Result<std::unique_ptr<Window>> open(const std::string &title, glm::ivec2 size, bool scaled);
    ~Window();
    Window(const Window &) = delete;
    Window &operator=(const Window &) = delete;

    // Sleeps until an event, a call of `wake` or `timeout` seconds; absent: no time limit.
    std::vector<Event> wait(std::optional<double> timeout);
    // Ends `wait`. Callable from any thread.
    static void wake();
    // Seconds of a monotonic clock.
    static double now();

    bool close_requested() const;
    void refuse_close();
    // Pixels; 0 x 0 while minimised.
    glm::ivec2 framebuffer_size() const;
    // The desktop's text scale, at least 1.
    double content_scale() const;

    void set_title(const std::string &title);
    // Puts text on the clipboard.
    void copy(const std::string &text);
    bool is_full_screen() const;
    void toggle_full_screen();
    // Shows the framebuffer.
    void swap();
    // Whether what the window shows is out of date: at first, and from `invalidate` to `validate`.
    bool is_stale() const { return stale_; }
    void invalidate() { stale_ = true; }
    void validate() { stale_ = false; }

  private:
    explicit Window(GLFWwindow *window);
    void receive_events();

    GLFWwindow *window_;
    std::vector<Event> events_;
    bool stale_ = true;
    // Position and size outside of full screen, screen coordinates.
    glm::ivec2 windowed_place_{0}, windowed_size_{0};
};

} // namespace pbm
