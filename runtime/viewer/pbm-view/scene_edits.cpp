#include "scene_edits.h"

#include "viewer/opening/prepared_model.h"
#include "viewer/pbm-view/light/light_motion.h"
#include "viewer/pbm-view/light/scene_saver.h"
#include "viewer/pbm-view/light/scene_text.h"
#include "viewer/pbm-view/window/view_text.h"
#include "viewer/pictures/picture_file.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <utility>

namespace pbm {
namespace {

// The name of a model without its folder and its extension.
std::string stem_of(const std::string &path) { return std::filesystem::path(path).stem().string(); }

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

SceneEdits::SceneEdits(Shown &shown, Pictures &pictures, Notices &notices, Window &window, ThreadPool &worker)
    : shown_(shown), pictures_(pictures), notices_(notices), window_(window), worker_(worker),
      shadows_(worker, shown.options.load.threads, shown.options.load.max_memory) {}

void SceneEdits::show_model() {
    shadows_.show(shown_.model);
    if (!shown_.model)
        return;
    kept_ = shown_.look->appearance;
    const ByteView header = slice(shown_.model->bytes(), 0, kHeaderBytes);
    header_.assign(header.begin(), header.end());
}

void SceneEdits::change(Look look) {
    shadows_.choose(look.appearance);
    const bool casts = look.options.render.shadows && appearance_for(look).lights_follow == LightsFollow::model;
    shadows_.request(look.appearance, casts, Window::now());
    shown_.look = std::make_shared<Look>(std::move(look));
    pictures_.change_view();
}

void SceneEdits::rake(glm::dvec2 pointer, std::size_t light) {
    if (!shown_.has_picture() || shown_.is_recorded)
        return;
    const double aspect = static_cast<double>(shown_.size.x) / shown_.size.y;
    Look look = *shown_.look;
    const bool with_eye = appearance_for(look).lights_follow == LightsFollow::eye;
    const EyeAxes axes = with_eye ? front_axes(look.appearance.up) : eye_axes(shown_.camera);
    const glm::dvec3 from = raking_direction(axes, {2 * pointer.x - aspect, 1 - 2 * pointer.y});
    if (look.options.headlight) {
        look.options.headlight = headlight_towards(from, axes);
    } else {
        Light &moved = look.appearance.lights[std::min(light, look.appearance.lights.size() - 1)];
        moved =
            moved_towards(moved, light_frame(shown_.model->grid(), shown_.model->bounds(), look.appearance.up), from);
    }
    change(std::move(look));
}

void SceneEdits::serve() {
    if (!shown_.model)
        return;
    receive_save(false);
    const auto before = shadows_.baking();
    if (shadows_.serve(Window::now())) {
        Look look = *shown_.look;
        shadows_.choose(look.appearance);
        shown_.look = std::make_shared<Look>(std::move(look));
        pictures_.restyle();
        if (notices_.verbose())
            std::cout << "shadows: baked" << std::endl;
    }
    if (const auto error = shadows_.take_error()) {
        notices_.notify("A moved light casts no shadow: " + error->message, true);
        notices_.fail(shown_.model->path(), {error->code, 0, "no new shadows: " + error->message});
    }
    if (shadows_.baking() != before)
        window_.invalidate();
    if (saves_after_baking_ && !shadows_.baking())
        save();
}

std::string SceneEdits::shadow_note(std::size_t light) const {
    const int streams = shown_.model ? shown_.model->parameters().attributes.lights : 0;
    if (streams == 0)
        return "";
    if (shown_.look->lights_follow() == LightsFollow::eye)
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
Look SceneEdits::look_to_keep() const {
    const Appearance &shown = shown_.look->appearance;
    const bool is_lit_anew =
        kept_ && shown.lights != kept_->lights && !lights_to_keep(shown, shown_.model->parameters()).empty();
    return is_lit_anew ? with_fixed_lights(*shown_.look, shown_.camera, shown_.model->grid()) : *shown_.look;
}

bool SceneEdits::is_unsaved() const { return shown_.look && kept_ && is_edited(shown_.look->appearance, *kept_); }

void SceneEdits::copy() const {
    if (!shown_.has_picture())
        return;
    const std::string &path = shown_.model->path();
    const Look look = look_to_keep();
    std::string text = "pbm-render " + shell_quoted(path) + " " +
                       view_as_options(shown_.camera, shown_.options, shown_.size) + look_as_options(look.options) +
                       detail_as_options(shown_.options) + " -o " + shell_quoted(stem_of(path) + ".png");
    if (is_unsaved())
        text += "\n# with a model that was built with these lights and materials:\npbm-build SCAN" +
                scene_as_options(look.appearance, shown_.model->parameters()) + " -o " + shell_quoted(path);
    window_.copy(text);
    notices_.print(text);
    notices_.notify("The command for this picture is on the clipboard");
}

void SceneEdits::save() {
    if (Look look = look_to_keep(); look.appearance.lights != shown_.look->appearance.lights)
        change(std::move(look));
    saves_after_baking_ = shadows_.baking().has_value();
    if (saves_after_baking_)
        return;
    SceneSave scene{.path = shown_.model->path(),
                    .opened = header_,
                    .appearance = shown_.look->appearance,
                    .up = shown_.up(),
                    .view = {shown_.camera, shown_.options.view_angle},
                    .baked = {},
                    .threads = shown_.options.load.threads,
                    .max_memory = shown_.options.load.max_memory};
    for (std::size_t light = 0; light < kMaxLights; ++light)
        scene.baked[light] = shadows_.baked(light);
    saved_ = scene.appearance;
    save_ = worker_.post([scene = std::move(scene)] { return save_scene(scene); });
}

void SceneEdits::receive_save(bool wait) {
    if (!save_.valid() || (!wait && !is_ready(save_)))
        return;
    Result<Bytes> saved = save_.get();
    const std::string name = file_name(shown_.model->path());
    if (saved) {
        header_ = std::move(*saved);
        kept_ = std::move(saved_);
        was_saved_ = true;
        notices_.print("saved " + shown_.model->path());
    } else {
        notices_.fail(shown_.model->path(), saved.error());
    }
    notices_.notify(saved ? "Saved into " + name : name + " was not saved: " + saved.error().message, !saved);
}

void SceneEdits::save_recipe() {
    const std::string &path = shown_.model->path();
    ModelParameters parameters = shown_.model->parameters();
    parameters.grid.up = shown_.up();
    const std::string text = scene_as_recipe(look_to_keep().appearance, parameters, file_name(path));
    const auto saved = save_numbered({}, stem_of(path), ".toml", as_bytes(text));
    if (saved)
        discard();
    notices_.report_saved(saved);
}

} // namespace pbm
