// Asks before something is lost, and goes back step by step: Escape, and the end of the program.
#include "viewer.h"

#include <utility>

namespace pbm {

void Viewer::ask(Question question) {
    question_ = std::move(question);
    stale_ = true;
}

// Whether a question, or the panel, takes a key of the window.
bool Viewer::answer(const KeyEvent &event) {
    if (!event.pressed)
        return false; // keys are released everywhere
    if (question_)
        return event.key == Key::quit ? (escape(), true) : true;
    if (!panel_has_keys_ || event.key == Key::panel_focus)
        return false;
    if (event.key == Key::quit && !overlay_.has_popup())
        focus_panel(false);
    return event.key != Key::copy && event.key != Key::save_scene;
}

// What the end of the program, or another model, would lose; empty for nothing. Saved views are in a file at once.
std::string Viewer::losses() const {
    std::string text;
    if (has_edits())
        text = "Lights or materials were changed and not saved.\n";
    if (const std::size_t points = line_.points().size(); points > 0)
        text += std::to_string(points) + (points == 1 ? " measured point" : " measured points") + " would be lost.\n";
    return text;
}

void Viewer::ask_about_losses(const std::string &what, std::function<void()> accept, bool quits) {
    Question question{.text = losses() + "Enter: " + what, .accept = std::move(accept), .quits = quits};
    if (has_edits()) {
        question.text += "    S: save ...";
        question.letter = 's';
        question.other = [this] { ask_to_save(); };
    }
    question.text += "    Escape: back";
    ask(std::move(question));
}

// Goes one step back: from what lies over the model, then from the tool in use, then from the panel and from the full
// screen. At last it quits.
void Viewer::escape() {
    stale_ = true;
    if (question_)
        question_.reset();
    else if (opening_ && opening_->progress() && !video_)
        opening_->cancel();
    else if (start_page_.is_shown() && (model_ || opening_))
        start_page_.hide();
    else if (show_help_)
        show_help_ = false;
    else if (end_drag() || leave_tool())
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
        options_.clip = drag.camera.clip;
    if (camera_ != drag.camera)
        move_to(drag.camera);
    if (look_ != drag.look)
        change_look(*drag.look);
    return true;
}

// Ends one tool that a key has begun. Returns whether there was one.
bool Viewer::leave_tool() {
    if (show_clip_handles_) {
        show_clip_handles_ = false;
        set_clip({});
    } else if (is_measuring()) {
        toggle_measuring();
    } else if (show_coordinates_) {
        show_coordinates_ = false;
    } else {
        return false;
    }
    return true;
}

void Viewer::request_quit() {
    quit_ = (question_ && question_->quits) || recording_ || video_ || losses().empty();
    if (quit_)
        return;
    window_.refuse_close();
    ask_about_losses(
        "quit", [this] { quit_ = true; }, true);
}

} // namespace pbm
