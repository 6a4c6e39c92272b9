// The panel, lights and their shadows, and what is kept of them: options, model, recipe.
#include "viewer.h"

#include "window/view_text.h"

#include "command_line/command_line.h"
#include "viewer/light/scene_saver.h"
#include "viewer/light/scene_text.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/pictures/picture_file.h"

#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <utility>

namespace pbm {
namespace {

namespace fs = std::filesystem;

// Whether two appearances differ in what a file stores of them.
bool is_edited(const Appearance &a, const Appearance &b) {
    return a.materials != b.materials || a.lights != b.lights || a.palette != b.palette ||
           a.ground_palette != b.ground_palette;
}

// Where a headlight stands for a raking direction of `axes`.
Headlight headlight_towards(const glm::dvec3 &from, const EyeAxes &axes) {
    const double up = std::asin(std::clamp(glm::dot(from, axes.up), -1.0, 1.0));
    const double right = std::atan2(glm::dot(from, axes.right), -glm::dot(from, axes.forward));
    return {.right = std::round(glm::degrees(right)), .up = std::round(glm::degrees(up))};
}

} // namespace

void Viewer::toggle_panel() {
    show_panel_ = !show_panel_;
    hint_until_.reset();
    if (!show_panel_)
        focus_panel(false);
    if (show_panel_ && mouse_)
        overlay_.point(*mouse_ * static_cast<double>(window_.framebuffer_size().y));
    update_panel();
}

// Gives the keyboard to the panel, or back to the view.
void Viewer::focus_panel(bool takes_keys) {
    if (takes_keys == panel_has_keys_ || !look_)
        return;
    panel_has_keys_ = takes_keys;
    if (!takes_keys)
        overlay_.release_keys();
    else
        panel_.take_focus();
    if (takes_keys && !show_panel_)
        toggle_panel();
    update_panel();
    stale_ = true;
}

// Passes the pending input to the panel and to the start page.
void Viewer::update_panel() {
    if (!has_windows() || window_.framebuffer_size().x <= 0)
        return;
    const bool had_mouse = overlay_.wants_mouse();
    std::optional<Look> changed;
    overlay_.update(window_.framebuffer_size(), [&] { build_windows(changed); });
    stale_ = stale_ || had_mouse || overlay_.wants_mouse() || panel_has_keys_;
    if (changed)
        change_look(std::move(*changed));
    if (const auto choice = std::exchange(page_choice_, std::nullopt))
        choose_from_page(choice);
    const auto action = panel_.take_action();
    if (action == PanelAction::copy_options)
        copy_options();
    else if (action == PanelAction::save)
        ask_to_save();
}

// Builds the panel and the start page in a frame of Dear ImGui. Sets `changed` if the panel changes the look.
void Viewer::build_windows(std::optional<Look> &changed) {
    const auto scale = static_cast<float>(window_.content_scale());
    if (has_panel()) {
        Look look = changed ? *changed : *look_;
        if (panel_.build(look, window_.framebuffer_size(), scale, shadow_note()))
            changed = std::move(look);
    }
    if (start_page_.is_shown())
        if (auto choice = start_page_.build(window_.framebuffer_size(), scale, model_ != nullptr))
            page_choice_ = std::move(choice);
}

void Viewer::change_look(Look look) {
    const bool recolours = look.options.colour_by != look_->options.colour_by;
    shadows_.choose(look.appearance);
    const bool casts = look.options.render.shadows && appearance_for(look).lights_follow == LightsFollow::model;
    shadows_.request(look.appearance, casts, Window::now());
    look_ = std::make_shared<Look>(std::move(look));
    change_view();
    if (recolours && model_) { // colours of fields are those of the chunks
        recolours_ = true;
        open(model_->path(), true);
    }
}

// Moves the panel's light, or the headlight, to where the pointer is on a ball that fills the picture's height. A light
// that follows the eye then stays there.
void Viewer::rake() {
    if (!model_ || !mouse_ || recording_ || view_size_.y <= 0)
        return;
    const double aspect = static_cast<double>(view_size_.x) / view_size_.y;
    Look look = *look_;
    const bool with_eye = appearance_for(look).lights_follow == LightsFollow::eye;
    const EyeAxes axes = with_eye ? front_axes(look.appearance.up) : eye_axes(camera_);
    const glm::dvec3 from = raking_direction(axes, {2 * mouse_->x - aspect, 1 - 2 * mouse_->y});
    if (look.options.headlight) {
        look.options.headlight = headlight_towards(from, axes);
    } else {
        Light &light = look.appearance.lights[std::min(panel_.light(), look.appearance.lights.size() - 1)];
        light = moved_towards(light, light_frame(model_->grid(), model_->bounds(), look.appearance.up), from);
    }
    change_look(std::move(look));
}

// Bakes the shadows of lights that were moved. The picture without them stays until one with them has full detail.
void Viewer::serve_shadows() {
    if (!model_)
        return;
    const auto before = shadows_.baking();
    if (shadows_.serve(Window::now())) {
        Look look = *look_;
        shadows_.choose(look.appearance);
        look_ = std::make_shared<Look>(std::move(look));
        ++view_; // a picture that is drawn now has the old shadows
        end_refinement();
        if (!draws_fine(look_->options.quality, Motion::still) || !scheduler_->complete())
            scheduler_->restyled(); // else the next fine picture replaces this one
        if (verbose())
            std::cout << "shadows: baked" << std::endl;
    }
    if (const auto error = shadows_.take_error()) {
        notify("A moved light casts no shadow: " + error->message, true);
        command_line::fail(program_, model_->path(), {error->code, 0, "no new shadows: " + error->message});
    }
    if (shadows_.baking() != before)
        stale_ = true;
    if (saves_after_baking_ && !shadows_.baking())
        begin_scene_save();
}

// How the shadows of the panel's light stand.
std::string Viewer::shadow_note() const {
    const std::size_t light = panel_.light();
    const int streams = model_ ? model_->parameters().attributes.lights : 0;
    if (streams == 0)
        return "";
    if (look_->lights_follow() == LightsFollow::eye)
        return "Lights that follow the eye cast no shadow.";
    if (static_cast<int>(light) >= streams)
        return "It casts no shadow in this file.";
    if (shadows_.baked(light))
        return "Its shadows were baked anew. They are hard.";
    if (!shadows_.is_stale(light))
        return "";
    return shadows_.baking() ? "Its shadows are baked anew ..." : "It casts no shadow: new ones could not be baked.";
}

// The look as files and options keep it: edited lights that follow the eye are fixed to the model where they stand now.
Look Viewer::look_to_keep() const {
    const Appearance &shown = look_->appearance;
    const bool is_lit_anew =
        kept_ && shown.lights != kept_->lights && !lights_to_keep(shown, model_->parameters()).empty();
    return is_lit_anew ? with_fixed_lights(*look_, camera_, model_->grid()) : *look_;
}

bool Viewer::has_edits() const { return look_ && kept_ && is_edited(look_->appearance, *kept_); }

// Puts the command that draws this picture on the clipboard, and the builder's options where lights or materials were
// changed.
void Viewer::copy_options() {
    if (!model_ || view_size_ == glm::ivec2(0))
        return;
    const std::string name = fs::path(model_->path()).stem().string();
    const Look look = look_to_keep();
    std::string text = "pbm-render " + shell_quoted(model_->path()) + " " +
                       view_as_options(camera_, options_, view_size_) + look_as_options(look.options) +
                       detail_as_options(options_) + " -o " + shell_quoted(name + ".png");
    if (has_edits())
        text += "\n# with a model that was built with these lights and materials:\npbm-build SCAN" +
                scene_as_options(look.appearance, model_->parameters()) + " -o " + shell_quoted(model_->path());
    window_.copy(text);
    if (options_.verbosity != command_line::Verbosity::quiet)
        std::cout << text << std::endl;
    notify("The command for this picture is on the clipboard", false);
}

void Viewer::ask_to_save() {
    if (!model_ || scene_save_.valid() || saves_after_baking_ || recording_)
        return;
    if (is_scan(model_->path())) // its model lies in the cache
        return ask({.text = file_name(model_->path()) +
                            " is a scan. Save lights and materials as a recipe of pbm-build?\n"
                            "Enter: save    Escape: back",
                    .accept = [this] { save_recipe(); },
                    .letter = 'r',
                    .other = [this] { save_recipe(); }});
    ask({.text = "Save lights, materials and view into " + file_name(model_->path()) +
                 "?\nEnter: save    R: as a recipe of pbm-build instead    Escape: back",
         .accept = [this] { begin_scene_save(); },
         .letter = 'r',
         .other = [this] { save_recipe(); }});
}

void Viewer::begin_scene_save() {
    if (Look look = look_to_keep(); look.appearance.lights != look_->appearance.lights)
        change_look(std::move(look));
    saves_after_baking_ = shadows_.baking().has_value();
    if (saves_after_baking_)
        return;
    SceneSave save{.path = model_->path(),
                   .opened = header_,
                   .appearance = look_->appearance,
                   .up = up_of(options_, model_->grid()),
                   .view = {camera_, options_.view_angle},
                   .baked = {},
                   .threads = options_.load.threads,
                   .max_memory = options_.load.max_memory};
    for (std::size_t light = 0; light < kMaxLights; ++light)
        save.baked[light] = shadows_.baked(light);
    scene_saved_ = save.appearance;
    scene_save_ = workers_.baking.post([save = std::move(save)] { return save_scene(save); });
}

// Reports a model that was saved or could not be. `wait`: until it is done.
void Viewer::receive_scene_save(bool wait) {
    if (!scene_save_.valid() || (!wait && !is_ready(scene_save_)))
        return;
    Result<Bytes> saved = scene_save_.get();
    const std::string name = file_name(model_->path());
    if (saved) {
        header_ = std::move(*saved);
        kept_ = std::move(scene_saved_);
        was_saved_ = true;
        if (options_.verbosity != command_line::Verbosity::quiet)
            std::cout << "saved " << model_->path() << std::endl;
    } else {
        command_line::fail(program_, model_->path(), saved.error());
    }
    notify(saved ? "Saved into " + name : name + " was not saved: " + saved.error().message, !saved);
}

void Viewer::save_recipe() {
    const std::string name = fs::path(model_->path()).stem().string();
    ModelParameters parameters = model_->parameters();
    parameters.grid.up = up_of(options_, parameters.grid);
    const std::string text = scene_as_recipe(look_to_keep().appearance, parameters, file_name(model_->path()));
    const auto saved = save_numbered({}, name, ".toml", as_bytes(text));
    if (!saved) {
        command_line::fail(program_, "", saved.error());
        return notify(saved.error().message, true);
    }
    kept_ = look_->appearance;
    if (options_.verbosity != command_line::Verbosity::quiet)
        std::cout << "saved " << *saved << std::endl;
    notify("Saved " + fs::absolute(*saved).string(), false);
}

} // namespace pbm
