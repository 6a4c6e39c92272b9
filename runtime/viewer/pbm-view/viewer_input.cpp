// Handles the window's events: the panel gets them first, then the view.
#include "viewer.h"
#include "window/view_text.h"

#include <glm/geometric.hpp>

namespace pbm {
namespace {

constexpr double kDoubleClick = 0.4;       // seconds
constexpr double kDoubleClickReach = 0.01; // picture heights
constexpr double kClickReach = 0.005;      // picture heights; what moves further is a drag

} // namespace

void Viewer::handle(const KeyEvent &event) {
    if (has_panel() && overlay_.wants_keys() && event.pressed)
        return; // a number is being typed
    if (answer(event))
        return;
    if (start_page_.is_shown() && event.pressed && (event.key == Key::up || event.key == Key::down)) {
        start_page_.move(event.key == Key::up ? -1 : 1);
        return update_panel(), static_cast<void>(stale_ = true);
    }
    static_assert(static_cast<int>(Key::left) == static_cast<int>(Arrow::left) &&
                  static_cast<int>(Key::down) == static_cast<int>(Arrow::down)); // the first keys are the arrows
    if (event.key <= Key::down) {
        const auto arrow = static_cast<Arrow>(event.key);
        return event.pressed ? arrows_.press(arrow, Window::now()) : arrows_.release(arrow, Window::now());
    }
    if (event.key == Key::light) {
        raking_ = event.pressed && model_ != nullptr;
        stale_ = true;
    }
    if (!event.pressed)
        return;
    switch (event.key) {
    case Key::quit: escape(); break;
    case Key::save: save(); break;
    case Key::reset:
        if (!start_page_.is_shown()) // Return chooses a row of it
            reset_camera();
        break;
    case Key::open_dialog: open_dialog(); break;
    case Key::start_page: start_page_.is_shown() ? start_page_.hide() : show_start_page(); break;
    case Key::previous_file: open_neighbour(-1); break;
    case Key::next_file: open_neighbour(1); break;
    case Key::up_axis: turn_up_axis(); break;
    case Key::help:
        show_help_ = !show_help_;
        hint_until_.reset();
        break;
    case Key::frame_time: show_frame_time_ = !show_frame_time_; break;
    case Key::panel: toggle_panel(); break;
    case Key::panel_focus: focus_panel(!panel_has_keys_); break;
    case Key::save_scene: ask_to_save(); break;
    case Key::full_screen: window_.toggle_full_screen(); break;
    case Key::switch_camera:
        mode_ = mode_ == CameraMode::orbit ? CameraMode::fly : CameraMode::orbit;
        notify(mode_ == CameraMode::orbit ? "Target camera" : "Flying camera", false);
        break;
    default: handle_view_key(event.key);
    }
    stale_ = true;
}

// Keys that move the camera to a view, cut the model open, or measure.
void Viewer::handle_view_key(Key key) {
    switch (key) {
    case Key::fit: fit(); break;
    case Key::view_front: look_from(StandardView::front); break;
    case Key::view_side: look_from(StandardView::side); break;
    case Key::view_top: look_from(StandardView::top); break;
    case Key::view_isometric: look_from(StandardView::isometric); break;
    case Key::projection: toggle_projection(); break;
    case Key::backs: switch_backs(); break;
    case Key::recall_6: recall_view(6); break;
    case Key::recall_7: recall_view(7); break;
    case Key::recall_8: recall_view(8); break;
    case Key::recall_9: recall_view(9); break;
    case Key::save_6: save_view(6); break;
    case Key::save_7: save_view(7); break;
    case Key::save_8: save_view(8); break;
    case Key::save_9: save_view(9); break;
    case Key::clip: switch_clip(); break;
    case Key::measure: toggle_measuring(); break;
    case Key::coordinates: show_coordinates_ = !show_coordinates_; break;
    case Key::copy: is_measuring() ? copy_measurement() : copy_options(); break;
    default: break;
    }
}

void Viewer::handle(const EditEvent &event) {
    if (question_ && event.pressed && event.key == EditKey::enter) {
        const auto accept = std::move(question_->accept);
        question_.reset();
        stale_ = true;
        return accept();
    }
    if (is_measuring() && event.pressed && !(has_windows() && overlay_.wants_keys())) {
        if (event.key == EditKey::backspace)
            line_.remove_last();
        else if (event.key == EditKey::erase)
            line_.clear();
        stale_ = true;
    }
    if (start_page_.is_shown() && event.key == EditKey::enter && event.pressed)
        choose_from_page(start_page_.take());
    if (has_windows() && (overlay_.wants_keys() || panel_has_keys_ || !event.pressed)) {
        overlay_.handle(event);
        update_panel();
    }
}

void Viewer::handle(const CharacterEvent &event) {
    if (question_ && question_->letter != 0 &&
        (event.character | 0x20U) == static_cast<unsigned char>(question_->letter)) {
        const auto other = std::move(question_->other);
        question_.reset();
        stale_ = true;
        return other();
    }
    if (has_windows() && overlay_.wants_keys()) {
        overlay_.handle(event);
        update_panel();
    }
}

void Viewer::handle(const ButtonEvent &event) {
    if (has_windows()) {
        overlay_.handle(event);
        update_panel();
    }
    if (!event.pressed) {
        if (drag_ && drag_->button == event.button) {
            if (is_measuring() && drag_->is_click && event.button == MouseButton::left)
                add_point();
            drag_.reset();
        }
        return;
    }
    if (drag_ || (has_windows() && overlay_.wants_mouse()))
        return;
    focus_panel(false);
    drag_ = {event.button, event.shift, mouse_.value_or(glm::dvec2(0)), true, camera_, look_};
    if (event.button == MouseButton::left && !event.shift && begin_clip_drag()) {
        drag_->is_click = false;
        return;
    }
    if (event.button != MouseButton::left || !mouse_ || is_measuring())
        return;
    if (raking_)
        return rake();
    const double now = Window::now();
    if (now - last_click_ < kDoubleClick && glm::length(*mouse_ - last_click_place_) < kDoubleClickReach) {
        focus();
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
        overlay_.point(event.position * static_cast<double>(window_.framebuffer_size().y));
        if (!drag_)
            update_panel();
    }
    stale_ = stale_ || show_coordinates_;
    if (!drag_ || !model_ || moved == glm::dvec2(0))
        return;
    if (drag_->handle)
        return drag_clip();
    if (raking_ && drag_->button == MouseButton::left)
        return rake();
    drag_->is_click = drag_->is_click && glm::length(*mouse_ - drag_->place) < kClickReach;
    if (is_measuring() && drag_->is_click)
        return; // the hand shakes
    Drag drag = Drag::turn;
    if (drag_->button == MouseButton::middle || (drag_->button == MouseButton::left && drag_->with_shift))
        drag = Drag::pan;
    else if (drag_->button == MouseButton::right)
        drag = Drag::distance;
    move_to(after_drag(camera_, steering(), drag, {moved.x, -moved.y}));
}

void Viewer::handle(const WheelEvent &event) {
    if (has_windows() && overlay_.wants_mouse()) {
        overlay_.handle(event);
        return update_panel();
    }
    if (event.notches != 0)
        zoom(event.notches);
}

void Viewer::handle(const DropEvent &event) {
    if (!video_ && !recording_)
        open_files(event.paths);
}

void Viewer::handle(const RefreshEvent & /*event*/) {
    overlay_.set_scale(window_.content_scale());
    update_panel(); // the panel moves with the window's size
    stale_ = true;
}

} // namespace pbm
