// Opens models and receives what is loaded of them.
#include "viewer.h"

#include "window/view_text.h"

#include "command_line/command_line.h"

#include <utility>

namespace pbm {
namespace {

// The camera of the command line is for the model of the command line only.
void forget_camera(ViewOptions &options) { options.position = options.focal_point = options.view_up = std::nullopt; }

} // namespace

// Takes the model if loading has ended. Returns the exit code if the first model cannot be shown.
std::optional<int> Viewer::receive_model() {
    if (!is_ready(loading_))
        return std::nullopt;
    auto loaded = loading_.get();
    const std::string path = std::exchange(loading_path_, "");
    stale_ = true;
    if (!loaded) {
        const Error error = with_advice(program_, loaded.error());
        const int code = command_line::fail(program_, path, error); // stderr gets it too
        if (!model_)
            return code;
        notify(file_name(path) + ": " + error.message, true);
    } else if (const Status shown = show(std::move(*loaded)); !shown) {
        return command_line::fail_usage(program_, shown.error().message);
    }
    if (const std::string next = std::exchange(dropped_path_, ""); !next.empty())
        open(next);
    return std::nullopt;
}

void Viewer::open(const std::string &path) {
    ViewOptions options = options_;
    if (model_)
        forget_camera(options);
    if (view_size_ != glm::ivec2(0))
        options.resolution = view_size_;
    loading_ = begin_loading(background_, path, options);
    loading_path_ = path;
    stale_ = true;
}

Status Viewer::show(ShownModelPointer loaded) {
    if (model_)
        forget_camera(options_);
    const auto camera = first_camera(*loaded);
    if (!camera)
        return camera.error();
    std::optional<LookOptions> shown_options;
    if (look_)
        shown_options = look_->options;
    destroy_in(background_, std::exchange(model_, std::move(loaded)));
    look_ = model_->first_look();
    camera_ = *camera;
    if (picture_size() != glm::ivec2(0))
        view_size_ = picture_size();
    // Options that the user has changed survive the change of model.
    if (shown_options)
        look_ = std::make_shared<Look>(*shown_options, model_->parameters());
    panel_.show_model(model_->parameters(), model_->has_panorama(), *model_->first_look());
    ++view_;
    end_refinement();
    scheduler_.emplace(options_.max_error, min_fps_);
    update_panel(); // lays out the panel before it is drawn
    has_reported_memory_ = false;
    window_.set_title(file_name(model_->path()) + " - " + std::string(program_) + " (F1: help)");
    return {};
}

// Newly loaded chunks improve the picture. Damaged ones are reported; coarser levels stay in their place.
void Viewer::receive_chunks() {
    if (!model_)
        return;
    if (model_->take_arrivals())
        scheduler_->arrived(!model_->streamed().is_loading());
    const std::vector<Error> errors = model_->take_errors();
    for (const Error &error : errors)
        command_line::fail(program_, model_->path(), with_advice(program_, error));
    if (!errors.empty())
        notify(file_name(model_->path()) + ": " + with_advice(program_, errors.front()).message, true);
}

} // namespace pbm
