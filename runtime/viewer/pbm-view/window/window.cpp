#include "viewer/pbm-view/window/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace pbm {
namespace {

// The last error message of GLFW, whose error callback has no user pointer.
std::string &last_complaint() {
    static std::string text;
    return text;
}

// If the X server disconnects or destroys the window, Xlib prints its own lines and calls exit(1).
bool &window_is_open() {
    static bool open = false;
    return open;
}

void say_that_the_display_is_lost() {
    if (!window_is_open())
        return;
    std::fputs("pbm-view: the display has taken the window away; pictures that were saved are whole\n", stderr);
    std::_Exit(exit_code(ErrorCode::memory));
}

Error no_window(const std::string &what) {
    const std::string &why = last_complaint();
    return {ErrorCode::memory, 0,
            what + (why.empty() ? "" : ": " + why) + "; pbm-render draws without display and OpenGL"};
}

constexpr std::array<std::pair<int, Key>, 30> kKeys{{{GLFW_KEY_LEFT, Key::left},
                                                     {GLFW_KEY_A, Key::left},
                                                     {GLFW_KEY_RIGHT, Key::right},
                                                     {GLFW_KEY_D, Key::right},
                                                     {GLFW_KEY_UP, Key::up},
                                                     {GLFW_KEY_W, Key::up},
                                                     {GLFW_KEY_DOWN, Key::down},
                                                     {GLFW_KEY_S, Key::down},
                                                     {GLFW_KEY_SPACE, Key::save},
                                                     {GLFW_KEY_F12, Key::save},
                                                     {GLFW_KEY_F, Key::fit},
                                                     {GLFW_KEY_ENTER, Key::reset},
                                                     {GLFW_KEY_U, Key::up_axis},
                                                     {GLFW_KEY_N, Key::colours},
                                                     {GLFW_KEY_I, Key::shading},
                                                     {GLFW_KEY_C, Key::switch_camera},
                                                     {GLFW_KEY_B, Key::backs},
                                                     {GLFW_KEY_M, Key::measure},
                                                     {GLFW_KEY_X, Key::coordinates},
                                                     {GLFW_KEY_K, Key::clip},
                                                     {GLFW_KEY_F1, Key::help},
                                                     {GLFW_KEY_H, Key::help},
                                                     {GLFW_KEY_F2, Key::frame_time},
                                                     {GLFW_KEY_TAB, Key::panel},
                                                     {GLFW_KEY_F11, Key::full_screen},
                                                     {GLFW_KEY_PAGE_UP, Key::previous_file},
                                                     {GLFW_KEY_PAGE_DOWN, Key::next_file},
                                                     {GLFW_KEY_L, Key::light},
                                                     {GLFW_KEY_F6, Key::panel_focus},
                                                     {GLFW_KEY_ESCAPE, Key::quit}}};
// Pressed while Control is held.
constexpr std::array<std::pair<int, Key>, 4> kControlKeys{{{GLFW_KEY_O, Key::open_dialog},
                                                           {GLFW_KEY_R, Key::start_page},
                                                           {GLFW_KEY_C, Key::copy},
                                                           {GLFW_KEY_S, Key::save_scene}}};
constexpr std::array<std::pair<int, EditKey>, 13> kEditKeys{{{GLFW_KEY_BACKSPACE, EditKey::backspace},
                                                             {GLFW_KEY_DELETE, EditKey::erase},
                                                             {GLFW_KEY_ENTER, EditKey::enter},
                                                             {GLFW_KEY_KP_ENTER, EditKey::enter},
                                                             {GLFW_KEY_ESCAPE, EditKey::cancel},
                                                             {GLFW_KEY_LEFT, EditKey::left},
                                                             {GLFW_KEY_RIGHT, EditKey::right},
                                                             {GLFW_KEY_HOME, EditKey::home},
                                                             {GLFW_KEY_END, EditKey::end},
                                                             {GLFW_KEY_UP, EditKey::up},
                                                             {GLFW_KEY_DOWN, EditKey::down},
                                                             {GLFW_KEY_TAB, EditKey::tab},
                                                             {GLFW_KEY_SPACE, EditKey::space}}};
constexpr std::array<std::pair<int, MouseButton>, 3> kButtons{{{GLFW_MOUSE_BUTTON_LEFT, MouseButton::left},
                                                               {GLFW_MOUSE_BUTTON_MIDDLE, MouseButton::middle},
                                                               {GLFW_MOUSE_BUTTON_RIGHT, MouseButton::right}}};

// The value of `key` in one of the tables above.
template <class Table> auto find(const Table &table, int key) {
    const auto found = std::find_if(table.begin(), table.end(), [&](const auto &row) { return row.first == key; });
    return found == table.end() ? std::nullopt : std::optional(found->second);
}

std::vector<Event> &events_of(GLFWwindow *window) {
    return *static_cast<std::vector<Event> *>(glfwGetWindowUserPointer(window));
}

// The monitor that shows most of the window.
GLFWmonitor *monitor_of(glm::ivec2 place, glm::ivec2 size) {
    int count = 0;
    GLFWmonitor **const monitors = glfwGetMonitors(&count);
    GLFWmonitor *best = glfwGetPrimaryMonitor();
    int most = 0;
    for (int i = 0; i < count; ++i) {
        glm::ivec2 corner, extent;
        glfwGetMonitorWorkarea(monitors[i], &corner.x, &corner.y, &extent.x, &extent.y);
        const int width = std::min(place.x + size.x, corner.x + extent.x) - std::max(place.x, corner.x);
        const int height = std::min(place.y + size.y, corner.y + extent.y) - std::max(place.y, corner.y);
        if (width > 0 && height > 0 && width * height > most) {
            most = width * height;
            best = monitors[i];
        }
    }
    return best;
}

} // namespace

Result<std::unique_ptr<Window>> Window::open(const std::string &title, glm::ivec2 size, bool scaled) {
    glfwSetErrorCallback([](int, const char *description) { last_complaint() = description; });
    last_complaint().clear();
    if (glfwInit() == GLFW_FALSE)
        return no_window("there is no display");
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 2);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_ALPHA_BITS, 0);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, scaled ? GLFW_TRUE : GLFW_FALSE);
    glfwWindowHintString(GLFW_X11_CLASS_NAME, "pbm-view");
    glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "pbm-view");
    GLFWwindow *const window = glfwCreateWindow(size.x, size.y, title.c_str(), nullptr, nullptr);
    if (window == nullptr) {
        const Error error = no_window("the display has no OpenGL 3.2");
        glfwTerminate();
        return error;
    }
    glfwMakeContextCurrent(window);
    glfwSwapInterval(1);
    window_is_open() = true;
    static const int registered = std::atexit(say_that_the_display_is_lost);
    static_cast<void>(registered);
    return std::unique_ptr<Window>(new Window(window));
}

Window::Window(GLFWwindow *window) : window_(window) { receive_events(); }

Window::~Window() {
    window_is_open() = false;
    glfwDestroyWindow(window_);
    glfwTerminate();
}

void Window::receive_events() {
    glfwSetWindowUserPointer(window_, &events_);
    glfwSetKeyCallback(window_, [](GLFWwindow *window, int key, int, int action, int modifiers) {
        // A key that was pressed without Control may be released with it.
        const bool control = (modifiers & GLFW_MOD_CONTROL) != 0 && action == GLFW_PRESS;
        auto meant = control ? find(kControlKeys, key) : find(kKeys, key);
        if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9)
            meant = control ? Key::control_digit : Key::digit;
        if (meant && action != GLFW_REPEAT)
            events_of(window).push_back(KeyEvent{*meant, action == GLFW_PRESS, key - GLFW_KEY_0});
        if (const auto known = find(kEditKeys, key))
            events_of(window).push_back(EditEvent{*known, action != GLFW_RELEASE});
    });
    glfwSetCharCallback(window_, [](GLFWwindow *window, unsigned character) {
        events_of(window).push_back(CharacterEvent{character});
    });
    // The press happened at the last reported position; the pointer may be elsewhere by now.
    glfwSetMouseButtonCallback(window_, [](GLFWwindow *window, int button, int action, int modifiers) {
        if (const auto known = find(kButtons, button))
            events_of(window).push_back(ButtonEvent{*known, action == GLFW_PRESS, (modifiers & GLFW_MOD_SHIFT) != 0,
                                                    (modifiers & GLFW_MOD_CONTROL) != 0});
    });
    glfwSetCursorPosCallback(window_, [](GLFWwindow *window, double x, double y) {
        // GLFW reports screen coordinates, which need not be pixels.
        glm::ivec2 size;
        glfwGetWindowSize(window, &size.x, &size.y);
        events_of(window).push_back(MoveEvent{glm::dvec2(x, y) / static_cast<double>(std::max(1, size.y))});
    });
    glfwSetScrollCallback(
        window_, [](GLFWwindow *window, double, double notches) { events_of(window).push_back(WheelEvent{notches}); });
    glfwSetDropCallback(window_, [](GLFWwindow *window, int count, const char **paths) {
        if (count > 0)
            events_of(window).push_back(DropEvent{{paths, paths + count}});
    });
    glfwSetWindowRefreshCallback(window_, [](GLFWwindow *window) { events_of(window).push_back(RefreshEvent{}); });
    glfwSetWindowIconifyCallback(window_, [](GLFWwindow *window, int) { events_of(window).push_back(RefreshEvent{}); });
    glfwSetWindowContentScaleCallback(
        window_, [](GLFWwindow *window, float, float) { events_of(window).push_back(RefreshEvent{}); });
    glfwSetFramebufferSizeCallback(window_,
                                   [](GLFWwindow *window, int, int) { events_of(window).push_back(RefreshEvent{}); });
}

std::vector<Event> Window::wait(std::optional<double> timeout) {
    if (!timeout)
        glfwWaitEvents();
    else if (*timeout > 0)
        glfwWaitEventsTimeout(*timeout);
    else
        glfwPollEvents();
    return std::exchange(events_, {});
}

void Window::wake() { glfwPostEmptyEvent(); }

double Window::now() { return glfwGetTime(); }

bool Window::close_requested() const { return glfwWindowShouldClose(window_) != GLFW_FALSE; }

void Window::refuse_close() { glfwSetWindowShouldClose(window_, GLFW_FALSE); }

glm::ivec2 Window::framebuffer_size() const {
    glm::ivec2 size;
    glfwGetFramebufferSize(window_, &size.x, &size.y);
    // X11 has no window without pixels: a minimised one keeps its size.
    return glfwGetWindowAttrib(window_, GLFW_ICONIFIED) != GLFW_FALSE ? glm::ivec2(0) : size;
}

double Window::content_scale() const {
    float x = 1, y = 1;
    glfwGetWindowContentScale(window_, &x, &y);
    return std::max(1.0F, std::max(x, y));
}

void Window::set_title(const std::string &title) { glfwSetWindowTitle(window_, title.c_str()); }

void Window::copy(const std::string &text) { glfwSetClipboardString(window_, text.c_str()); }

bool Window::is_full_screen() const { return glfwGetWindowMonitor(window_) != nullptr; }

void Window::toggle_full_screen() {
    if (is_full_screen()) {
        glfwSetWindowMonitor(window_, nullptr, windowed_place_.x, windowed_place_.y, windowed_size_.x, windowed_size_.y,
                             GLFW_DONT_CARE);
        return;
    }
    glfwGetWindowPos(window_, &windowed_place_.x, &windowed_place_.y);
    glfwGetWindowSize(window_, &windowed_size_.x, &windowed_size_.y);
    GLFWmonitor *const monitor = monitor_of(windowed_place_, windowed_size_);
    const GLFWvidmode *const mode = monitor == nullptr ? nullptr : glfwGetVideoMode(monitor);
    if (mode == nullptr)
        return;
    glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

void Window::swap() { glfwSwapBuffers(window_); }

} // namespace pbm
