// Handles the window's events: the panel gets them first, then the view.
#include "viewer.h"

#include <glm/geometric.hpp>

namespace pbm {
namespace {

constexpr double kDoubleClick = 0.4;       // seconds
constexpr double kDoubleClickReach = 0.01; // picture heights
constexpr double kClickReach = 0.005;      // picture heights; what moves further is a drag

} // namespace

// Passes an event to panel and start page.
template <class Input> void Viewer::pass(const Input &event) {
    overlay_.handle(event);
    update_windows();
}

void Viewer::handle(const KeyEvent &event) {
    if (has_panel() && overlay_.wants_keys() && event.pressed)
        return; // a number is being typed
    if (answer(event))
        return;
    if (start_page_.is_shown() && event.pressed && (event.key == Key::up || event.key == Key::down)) {
        start_page_.move(event.key == Key::up ? -1 : 1);
        update_windows();
        return window_.invalidate();
    }
    static_assert(static_cast<int>(Key::left) == static_cast<int>(Arrow::left) &&
                  static_cast<int>(Key::down) == static_cast<int>(Arrow::down)); // the first keys are the arrows
    if (event.key <= Key::down)
        return navigator_.press(static_cast<Arrow>(event.key), event.pressed);
    if (event.key == Key::light) {
        raking_ = event.pressed && shown_.model != nullptr;
        window_.invalidate();
    }
    if (!event.pressed)
        return;
    switch (event.key) {
    case Key::quit: escape(); break;
    case Key::save: pictures_.save(); break;
    case Key::reset:
        if (!start_page_.is_shown()) // Return chooses a row of it
            navigator_.reset(picture_size());
        break;
    case Key::open_dialog: open_dialog(); break;
    case Key::start_page: start_page_.is_shown() ? start_page_.hide() : show_start_page(); break;
    case Key::previous_file: open_neighbour(-1); break;
    case Key::next_file: open_neighbour(1); break;
    case Key::up_axis: navigator_.turn_up_axis(picture_size()); break;
    case Key::colours: next_colours(); break;
    case Key::shading: next_shading(); break;
    case Key::help:
        show_help_ = !show_help_;
        hint_until_.reset();
        break;
    case Key::frame_time: show_frame_time_ = !show_frame_time_; break;
    case Key::panel: toggle_panel(); break;
    case Key::panel_focus: focus_panel(!panel_has_keys_); break;
    case Key::save_scene: ask_to_save(); break;
    case Key::full_screen: window_.toggle_full_screen(); break;
    case Key::switch_camera: navigator_.switch_mode(); break;
    default: handle_view_key(event);
    }
    window_.invalidate();
}

// Keys that move the camera to a view, cut the model open, or measure.
void Viewer::handle_view_key(const KeyEvent &event) {
    switch (event.key) {
    case Key::fit: navigator_.fit(); break;
    case Key::digit: navigator_.choose_view(event.digit); break;
    case Key::control_digit: navigator_.save_view(event.digit); break;
    case Key::backs: navigator_.switch_backs(); break;
    case Key::clip: tools_.switch_clip(); break;
    case Key::measure: tools_.toggle_measuring(); break;
    case Key::coordinates: tools_.toggle_coordinates(); break;
    case Key::copy: tools_.is_measuring() ? tools_.copy() : edits_.copy(); break;
    default: break;
    }
}

void Viewer::handle(const EditEvent &event) {
    if (question_ && event.pressed && event.key == EditKey::enter)
        return settle(&Question::accept);
    if (tools_.is_measuring() && event.pressed && !(has_windows() && overlay_.wants_keys()))
        tools_.edit(event.key);
    if (start_page_.is_shown() && event.key == EditKey::enter && event.pressed)
        choose_from_page(start_page_.take());
    if (has_windows() && (overlay_.wants_keys() || panel_has_keys_ || !event.pressed))
        pass(event);
}

void Viewer::handle(const CharacterEvent &event) {
    if (question_ && question_->letter != 0 &&
        (event.character | 0x20U) == static_cast<unsigned char>(question_->letter))
        return settle(&Question::other);
    if (has_windows() && overlay_.wants_keys())
        pass(event);
}

void Viewer::handle(const ButtonEvent &event) {
    if (has_windows())
        pass(event);
    if (!event.pressed) {
        if (drag_ && drag_->button == event.button) {
            if (tools_.is_measuring() && drag_->is_click && event.button == MouseButton::left)
                tools_.add_point(seen());
            drag_.reset();
        }
        return;
    }
    if (drag_ || (has_windows() && overlay_.wants_mouse()))
        return;
    focus_panel(false);
    drag_ = {event.button, event.shift, mouse_.value_or(glm::dvec2(0)), true, shown_.camera, shown_.look};
    if (event.button == MouseButton::left && !event.shift && (drag_->handle = tools_.handle_at(mouse_pixel()))) {
        drag_->is_click = false;
        return;
    }
    if (event.button != MouseButton::left || !mouse_ || tools_.is_measuring())
        return;
    if (raking_)
        return edits_.rake(*mouse_, panel_.light());
    const double now = Window::now();
    if (now - last_click_ < kDoubleClick && glm::length(*mouse_ - last_click_place_) < kDoubleClickReach) {
        if (const auto point = seen()) // moves it to the middle of the picture
            navigator_.glide_to(focused(shown_.camera, point->place));
        last_click_ = -1; // a third click starts a new pair
        return;
    }
    last_click_ = now;
    last_click_place_ = *mouse_;
}

void Viewer::handle(const MoveEvent &event) {
    const glm::dvec2 moved = event.position - mouse_.value_or(event.position);
    mouse_ = event.position;
    if (has_windows()) {
        point_overlay();
        if (!drag_)
            update_windows();
    }
    if (tools_.shows_coordinates())
        window_.invalidate();
    if (!drag_ || !shown_.model || moved == glm::dvec2(0))
        return;
    if (drag_->handle)
        return tools_.drag_clip(*drag_->handle, mouse_pixel());
    if (raking_ && drag_->button == MouseButton::left)
        return edits_.rake(*mouse_, panel_.light());
    drag_->is_click = drag_->is_click && glm::length(*mouse_ - drag_->place) < kClickReach;
    if (tools_.is_measuring() && drag_->is_click)
        return; // the hand shakes
    Drag drag = Drag::turn;
    if (drag_->button == MouseButton::middle || (drag_->button == MouseButton::left && drag_->with_shift))
        drag = Drag::pan;
    else if (drag_->button == MouseButton::right)
        drag = Drag::distance;
    navigator_.drag(drag, {moved.x, -moved.y});
}

void Viewer::handle(const WheelEvent &event) {
    if (has_windows() && overlay_.wants_mouse())
        return pass(event);
    if (event.notches != 0)
        navigator_.zoom(event.notches, mouse_pixel(), seen());
}

void Viewer::handle(const DropEvent &event) {
    if (!recording_)
        open_files(event.paths);
}

void Viewer::handle(const RefreshEvent & /*event*/) {
    overlay_.set_scale(window_.content_scale());
    update_windows(); // the panel moves with the window's size
    window_.invalidate();
}

// Pixels from the upper left corner of the picture; its middle as long as the mouse has not moved in the window.
glm::dvec2 Viewer::mouse_pixel() const {
    return mouse_ ? *mouse_ * static_cast<double>(window_.framebuffer_size().y) : glm::dvec2(shown_.size) / 2.0;
}

std::optional<MeasuredPoint> Viewer::seen() const { return mouse_ ? pictures_.pick(mouse_pixel()) : std::nullopt; }

// Goes one step back: from what lies over the model, then from the tool in use, then from the panel and from the full
// screen. At last it quits.
void Viewer::escape() {
    window_.invalidate();
    if (question_)
        question_.reset();
    else if (opener_.opening() && opener_.opening()->progress() && !recording_)
        opener_.opening()->cancel();
    else if (start_page_.is_shown() && (shown_.model || opener_.opening()))
        start_page_.hide();
    else if (show_help_)
        show_help_ = false;
    else if (end_drag() || tools_.leave())
        return;
    else if (has_panel())
        toggle_panel();
    else if (window_.is_full_screen())
        window_.toggle_full_screen();
    else
        request_quit();
}

// Takes a drag back that the mouse has not ended. Returns whether there was one.
bool Viewer::end_drag() {
    if (!drag_)
        return false;
    const HeldButton drag = *std::exchange(drag_, std::nullopt);
    if (drag.handle)
        shown_.options.clip = drag.camera.clip;
    if (shown_.camera != drag.camera)
        navigator_.move_to(drag.camera);
    if (shown_.look != drag.look)
        change_look(*drag.look);
    return true;
}

void Viewer::request_quit() {
    quit_ = (question_ && question_->quits) || recording_ || losses().empty();
    if (quit_)
        return;
    window_.refuse_close();
    ask_about_losses(
        "quit", [this] { quit_ = true; }, true);
}

} // namespace pbm
