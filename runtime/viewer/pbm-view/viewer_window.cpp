// The panel, the start page, questions and texts over the picture.
#include "viewer.h"

#include "pbm_render/appearance/field_choice.h"
#include "viewer/pbm-view/window/desktop.h"
#include "viewer/pbm-view/window/view_text.h"

#include <glm/common.hpp>

#include <algorithm>
#include <utility>

namespace pbm {

// Asks once which theme the desktop prefers, which starts a process: after the first picture of a model.
void Viewer::ask_desktop() {
    if (panel_.theme() != Theme::desktop || (opener_.opening() && frame_log_.frames() == 0) || asks_desktop_.valid() ||
        desktop_is_light_)
        return;
    asks_desktop_ = workers_.helpers.post(desktop_prefers_light);
}

void Viewer::update_theme() {
    if (is_ready(asks_desktop_))
        desktop_is_light_ = asks_desktop_.get();
    const bool light =
        panel_.theme() == Theme::light || (panel_.theme() == Theme::desktop && desktop_is_light_.value_or(false));
    if (overlay_.set_light_theme(light))
        window_.invalidate();
}

void Viewer::toggle_panel() {
    show_panel_ = !show_panel_;
    hint_until_.reset();
    if (show_panel_)
        point_overlay();
    else
        focus_panel(false);
    update_windows();
}

// Gives the keyboard to the panel, or back to the view.
void Viewer::focus_panel(bool takes_keys) {
    if (takes_keys == panel_has_keys_ || !shown_.look)
        return;
    panel_has_keys_ = takes_keys;
    if (!takes_keys)
        overlay_.release_keys();
    else
        panel_.take_focus();
    if (takes_keys && !show_panel_)
        toggle_panel();
    update_windows();
    window_.invalidate();
}

// Tells panel and start page where the mouse is.
void Viewer::point_overlay() {
    if (mouse_)
        overlay_.point(*mouse_ * static_cast<double>(window_.framebuffer_size().y));
}

// Passes the pending input to the panel and to the start page.
void Viewer::update_windows() {
    if (!has_windows() || window_.framebuffer_size().x <= 0)
        return;
    const bool had_mouse = overlay_.wants_mouse();
    std::optional<Look> changed;
    overlay_.update(window_.framebuffer_size(), [&] { build_windows(changed); });
    if (had_mouse || overlay_.wants_mouse() || panel_has_keys_)
        window_.invalidate();
    if (changed)
        change_look(std::move(*changed));
    if (const auto choice = std::exchange(page_choice_, std::nullopt))
        choose_from_page(choice);
    const auto action = panel_.take_action();
    if (action == PanelAction::copy_options)
        edits_.copy();
    else if (action == PanelAction::save)
        ask_to_save();
}

// Builds the panel and the start page in a frame of Dear ImGui. Sets `changed` if the panel changes the look.
void Viewer::build_windows(std::optional<Look> &changed) {
    const auto scale = static_cast<float>(window_.content_scale());
    if (has_panel()) {
        Look look = changed ? *changed : *shown_.look;
        if (panel_.build(look, window_.framebuffer_size(), scale, edits_.shadow_note(panel_.light())))
            changed = std::move(look);
    }
    if (start_page_.is_shown())
        if (auto choice = start_page_.build(window_.framebuffer_size(), scale, shown_.model != nullptr))
            page_choice_ = std::move(choice);
}

void Viewer::change_look(Look look) {
    const LookOptions &before = shown_.look->options;
    const bool recolours = look.options.colour_by != before.colour_by || look.options.classes != before.classes;
    edits_.change(std::move(look));
    if (recolours && shown_.model) { // colours of fields, and hidden points, are those of the chunks
        recolours_ = true;
        open(shown_.model->path(), true);
    }
}

// Goes on to the next of the model's colours, after the last one to those of the file.
void Viewer::next_colours() {
    if (!shown_.model || shown_.is_recorded)
        return;
    Look look = *shown_.look;
    const std::vector<std::string> names = colour_names(shown_.model->parameters());
    const auto &by = look.options.colour_by;
    const auto now = by ? std::find(names.begin(), names.end(), by->field) : names.end();
    const auto next = now == names.end() ? names.begin() : now + 1;
    if (next == names.end())
        look.options.colour_by = std::nullopt;
    else
        colour_by(*next, look.options);
    notices_.notify("Colours: " + (next == names.end() ? "as in the file" : *next));
    change_look(std::move(look));
}

void Viewer::next_shading() {
    if (!shown_.model || shown_.is_recorded)
        return;
    Look look = *shown_.look;
    Shading &shading = look.options.render.shading;
    shading = static_cast<Shading>((static_cast<int>(shading) + 1) % 3);
    notices_.notify(shading == Shading::automatic ? "Light: automatic"
                    : shading == Shading::lit     ? "Light: lit"
                                                  : "Light: none, colours alone");
    change_look(std::move(look));
}

void Viewer::ask(Question question) {
    question_ = std::move(question);
    window_.invalidate();
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

// Closes the question and goes the way that the user has chosen.
void Viewer::settle(std::function<void()> Question::*way) {
    const Question question = std::move(*question_);
    question_.reset();
    window_.invalidate();
    (question.*way)();
}

// What the end of the program, or another model, would lose; empty for nothing. Saved views are in a file at once.
std::string Viewer::losses() const {
    return (edits_.is_unsaved() ? "Lights or materials were changed and not saved.\n" : "") + tools_.losses();
}

void Viewer::ask_about_losses(const std::string &what, std::function<void()> accept, bool quits) {
    Question question{.text = losses() + "Enter: " + what, .accept = std::move(accept), .quits = quits};
    if (edits_.is_unsaved()) {
        question.text += "    S: save ...";
        question.letter = 's';
        question.other = [this] { ask_to_save(); };
    }
    question.text += "    Escape: back";
    ask(std::move(question));
}

void Viewer::ask_to_save() {
    if (!shown_.model || edits_.is_saving() || edits_.waits_to_save() || shown_.is_recorded)
        return;
    const std::string &path = shown_.model->path();
    const std::function<void()> save_recipe = [this] { edits_.save_recipe(); };
    if (is_scan(path)) // its model lies in the cache
        return ask({file_name(path) + " is a scan. Save lights and materials as a recipe of pbm-build?\n"
                                      "Enter: save    Escape: back",
                    save_recipe, 'r', save_recipe});
    ask({"Save lights, materials and view into " + file_name(path) +
             "?\nEnter: save    R: as a recipe of pbm-build instead    Escape: back",
         [this] { edits_.save(); }, 'r', save_recipe});
}

// Size of the window in pixels beside a docked panel, clamped to what OpenGL can show; 0 x 0 if there are none.
glm::ivec2 Viewer::picture_size() const {
    glm::ivec2 size = window_.framebuffer_size();
    if (has_panel())
        size.x -= Panel::docked_width(size, static_cast<float>(window_.content_scale()));
    if (size.x <= 0 || size.y <= 0)
        return glm::ivec2(0);
    return glm::min(size, std::min(pictures_.presenter().max_edge(), kMaxPictureEdge));
}

OverlayText Viewer::overlay_text() const {
    OverlayText text;
    if (const Opening *const opening = opener_.opening()) {
        const auto progress = opening->progress();
        const std::string name = file_name(opening->path());
        text.middle = progress ? "Building the model of " + name + ": " + progress->step + "\nEscape cancels"
                               : "Loading " + name + " ...";
        if (progress)
            text.progress = progress->done;
    }
    if (question_) {
        text.middle = question_->text;
    } else if (show_help_) {
        text.help_title = std::string(notices_.program()) + " " PBM_VERSION;
        text.help = help_rows(navigator_.mode());
    }
    if (shown_.is_recorded)
        text.corner = "Recording frame " + std::to_string(recording_->frame()) + " of " +
                      std::to_string(recording_->video().frames) + "   Escape stops";
    else if (show_frame_time_ && pictures_.is_shown())
        text.corner = cost_text(pictures_.drawn(), shown_.model->depth(), shown_.size);
    if (shown_.model)
        text.drawing = tools_.drawing(tools_.shows_coordinates() ? seen() : std::nullopt);
    text.status = status_text();
    if (hint_until_)
        text.status_opacity = hint_opacity();
    text.notice = notices_.text();
    text.notice_is_problem = notices_.is_problem();
    return text;
}

// What goes on, most urgent first.
std::string Viewer::status_text() const {
    if (raking_)
        return "Drag: the light comes from where the pointer is";
    if (std::string status = follower_ ? follower_->status() : ""; !status.empty())
        return status;
    if (edits_.is_saving())
        return "Saving " + file_name(shown_.model->path()) + " ...";
    if (hint_until_)
        return "F1: help    Tab: panel";
    if (const auto light = edits_.baking(); light && shown_.look)
        return "Baking shadows of " + light_name(shown_.look->appearance.lights[*light], *light) + " ...";
    return "";
}

void Viewer::present() {
    const glm::ivec2 size = window_.framebuffer_size();
    window_.validate();
    if (size.x <= 0 || size.y <= 0)
        return;
    const LookOptions &look = shown_.look ? shown_.look->options : shown_.options.look;
    pictures_.presenter().draw(size, look.render.background);
    if (const OverlayText text = overlay_text(); has_windows() || !text.empty()) {
        std::optional<Look> changed;
        overlay_.draw(size, picture_size(), text, has_windows() ? [&] { build_windows(changed); } : Overlay::Build());
        if (changed)
            change_look(std::move(*changed));
    }
    window_.swap();
    frame_log_.count();
    if (notices_.verbose())
        frame_log_.report(shown_, pictures_, navigator_.is_gliding());
}

} // namespace pbm
