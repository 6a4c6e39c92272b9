// Draws, refines, saves and records the pictures of the model that is shown.
#include "viewer.h"

#include "window/view_text.h"

#include "command_line/command_line.h"

#include <filesystem>
#include <iostream>
#include <utility>

namespace pbm {

void Viewer::draw_due_picture() {
    const glm::ivec2 size = picture_size();
    if (recording_ || overwritten_ || !model_ || size == glm::ivec2(0))
        return;
    if (size != view_size_) {
        view_size_ = size;
        change_view();
    }
    const auto points_at = [&](double max_error) {
        std::uint64_t points = 0;
        for (const PointRun &run : model_->streamed().choose(model_->view(camera_, size, max_error)).runs)
            points += run.last - run.first;
        return points;
    };
    const auto step = scheduler_->next(Window::now(), points_at);
    if (!step)
        return;
    const DetailView view = model_->view(camera_, size, step->max_error);
    if (step->at_once)
        draw_now(view);
    else if (!drawing_.valid())
        draw_in_background(view);
}

// The view at full detail.
DetailView Viewer::still_view() const { return model_->view(camera_, view_size_, errors().still); }

FrameScheduler::Errors Viewer::errors() const {
    const auto of = [&](Motion motion) { return max_error_of(options_, look_->options.quality, motion); };
    return {.still = of(Motion::still), .moving = of(Motion::moving)};
}

// Chooses what is loaded for a view. Requests what is missing, unless a picture to be saved needs other chunks.
Detail Viewer::choose(const DetailView &view) {
    Detail detail = model_->streamed().choose(view);
    if (!saver_.is_waiting())
        model_->streamed().request(detail.missing);
    return detail;
}

void Viewer::draw_now(const DetailView &view) {
    if (!canvas_ || glm::ivec2(canvas_->width, canvas_->height) != view_size_)
        canvas_.emplace(view_size_.x, view_size_.y);
    const bool first_of_view = !scheduler_->shown();
    const PictureStatistics drawn = model_->draw_now(choose(view), view, look_, *canvas_);
    if (drawn.is_lost && !video_) {
        canvas_.reset();
        return hold_picture();
    }
    show_picture(view.max_error, drawn);
    if (first_of_view && verbose())
        std::cout << "view: " << view_as_options(camera_, options_, view_size_) << look_as_options(look_->options)
                  << std::endl;
}

void Viewer::draw_in_background(const DetailView &view) {
    drawing_ = background_.post([model = model_, detail = choose(view), view, look = look_, number = view_] {
        Picture picture{number, view.max_error, Framebuffer(view.width, view.height), {}};
        picture.drawn = model->draw_in_background(detail, view, look, picture.pixels);
        return picture;
    });
}

// Shows the picture that was drawn in the background, unless the view has changed.
void Viewer::receive_picture() {
    if (!is_ready(drawing_))
        return;
    Picture picture = drawing_.get();
    if (picture.view == view_ && picture.drawn.is_lost && !video_)
        hold_picture();
    if (picture.view == view_) {
        canvas_ = std::move(picture.pixels);
        show_picture(picture.max_error, picture.drawn);
    }
    full_view_ = 0; // the picture held chunks, maybe of an old view
}

// When to start to refine the picture shown; absent if it is not to be refined, or is already.
std::optional<double> Viewer::refinement_due() const {
    if (!scheduler_ || refinement_ || overwritten_ || samples_ > 0 || recording_ || video_ ||
        !draws_fine(look_->options.quality, Motion::still))
        return std::nullopt;
    return scheduler_->refinement_due();
}

// Refines a view that rests at full detail, unless its look asks for fast pictures.
void Viewer::refine() {
    if (refinement_) {
        auto picture = refinement_->receive();
        if (!picture)
            return;
        if (picture->drawn.is_lost)
            return hold_picture();
        canvas_ = std::move(picture->pixels);
        presenter_.upload(*canvas_);
        drawn_ = picture->drawn;
        samples_ = picture->samples;
        stale_ = true;
        return;
    }
    if (const auto when = refinement_due(); !when || Window::now() < *when)
        return;
    const DetailView view = still_view();
    Detail detail = model_->streamed().choose(view);
    if (detail.missing.empty())
        refinement_ = std::make_unique<Refinement>(background_, model_, std::move(detail), view, look_);
}

void Viewer::end_refinement() {
    if (refinement_)
        full_view_ = 0; // the refinement held chunks
    refinement_.reset();
    samples_ = 0;
}

// Shows `canvas_`, which holds a picture of the present view.
void Viewer::show_picture(double max_error, const PictureStatistics &drawn) {
    const double begin = Window::now();
    end_refinement();
    presenter_.upload(*canvas_);
    canvas_camera_ = camera_;
    drawn_ = drawn;
    const double now = Window::now();
    scheduler_->drawn({.max_error = max_error,
                       .points = drawn.drawn.points,
                       .complete = drawn.missing == 0,
                       .seconds = drawn.seconds + now - begin},
                      now);
    stale_ = true;
}

// Reports, once per model, that the chunks which the picture lacks do not fit into the memory allowed.
void Viewer::check_room() {
    if (!model_ || overwritten_ || !scheduler_->shown() || scheduler_->complete() || scheduler_->due() ||
        drawing_.valid() || saver_.is_waiting() || view_ == full_view_ || model_->streamed().is_loading())
        return;
    if (choose(still_view()).missing.size() != drawn_.missing)
        return scheduler_->arrived(true);
    full_view_ = view_;
    if (std::exchange(has_reported_memory_, true))
        return;
    const Error error =
        with_advice(program_, {ErrorCode::memory, 0,
                               "the picture needs more memory than allowed (" +
                                   std::to_string(options_.load.max_memory >> 20) + " MiB) and is coarser"});
    command_line::fail(program_, model_->path(), error);
    notify(file_name(model_->path()) + ": " + error.message, true);
}

// Saves the view at full detail, whatever is shown at the moment.
void Viewer::save() {
    if (model_ && view_size_ != glm::ivec2(0))
        saver_.add(model_, still_view(), look_);
}

// Called after everything else that chooses chunks, so that the chunks of the last view are not evicted.
void Viewer::serve_saver() {
    if (!saver_.is_waiting())
        return;
    saver_.serve();
    if (!saver_.is_waiting() && scheduler_)
        scheduler_->arrived(true);
}

// Reports pictures that were saved or failed. `all`: waits for those not yet done.
void Viewer::receive_saves(bool all) {
    for (const Result<std::string> &saved : saver_.take_done(all)) {
        if (saved && options_.verbosity != command_line::Verbosity::quiet)
            std::cout << "saved " << *saved << std::endl;
        if (!saved)
            command_line::fail(program_, "", saved.error());
        notify(saved ? "Saved " + std::filesystem::absolute(*saved).string() : saved.error().message, !saved);
        full_view_ = 0; // the saved picture held chunks
    }
}

// Starts the video once the picture has full detail, then draws one frame per call; the last call ends the program.
void Viewer::record() {
    if (!recording_) {
        if (!scheduler_ || !scheduler_->complete())
            return;
        recording_ = std::make_unique<Recording>(std::move(*video_), video_options_, options_, camera_,
                                                 up_direction(up_of(options_, model_->grid())));
        video_.reset();
    }
    if (recording_->done())
        return end_recording(recording_->finish());
    const Camera camera = recording_->camera();
    const Status added =
        recording_->add(*model_, look_, [&](const Framebuffer &pixels, const PictureStatistics &drawn) {
            presenter_.upload(pixels);
            drawn_ = drawn;
            stale_ = true;
            if (verbose())
                std::cout << "view: " << view_as_options(camera, options_, options_.resolution)
                          << look_as_options(look_of(Motion::moving, look_->options)) << std::endl;
        });
    if (!added)
        end_recording(added);
}

void Viewer::end_recording(const Status &status) {
    recording_.reset();
    quit_ = true;
    if (!status && has_offset(status.error())) // of the model
        exit_code_ = command_line::fail(program_, model_->path(), with_advice(program_, status.error()));
    else if (!status)
        exit_code_ = command_line::fail(program_, video_options_.output, status.error());
    else if (options_.verbosity != command_line::Verbosity::quiet && video_options_.output != "-")
        std::cout << "saved " << video_options_.output << std::endl;
}

} // namespace pbm
