#include "viewer/pbm-view/drawing/pictures.h"

#include "viewer/pbm-view/window/view_text.h"

#include <glm/common.hpp>

#include <algorithm>
#include <iostream>
#include <utility>

namespace pbm {

void Pictures::show_model() {
    canvas_.reset();
    camera_ = {};
    hold();
    scheduler_.emplace(errors(), min_fps_);
    has_reported_memory_ = false;
}

void Pictures::change_view() {
    hold();
    scheduler_->view_changed(Window::now(), errors());
}

void Pictures::restyle() {
    hold();
    if (!draws_fine(shown_.look->options.quality, Motion::still) || !scheduler_->complete())
        scheduler_->restyled(); // else the next fine picture replaces this one
}

void Pictures::hold() {
    ++view_;
    end_refinement();
}

void Pictures::receive() {
    if (shown_.model && shown_.model->take_arrivals())
        scheduler_->arrived(!shown_.model->streamed().is_loading());
    receive_saves(false);
    receive_picture();
}

void Pictures::draw(glm::ivec2 size) {
    draw_due(size);
    refine();
    if (saver_.is_waiting()) { // after all that chooses chunks, so that those of the last view are not evicted
        saver_.serve();
        if (!saver_.is_waiting() && scheduler_)
            scheduler_->arrived(true);
    }
    check_room();
}

std::optional<double> Pictures::due(glm::ivec2 size) const {
    if (!scheduler_ || shown_.is_overwritten)
        return std::nullopt;
    std::optional<double> at = refinement_due();
    if (at && *at <= Window::now() && waits_for_chunks_)
        at.reset(); // they wake the window
    // A fine picture that is due waits for the one in progress.
    if (size != glm::ivec2(0) && !(scheduler_->shown() && (drawing_.valid() || is_refining())))
        if (const auto due = scheduler_->due())
            at = std::min(at.value_or(*due), *due);
    return at;
}

void Pictures::draw_due(glm::ivec2 size) {
    if (shown_.is_recorded || shown_.is_overwritten || !shown_.model || size == glm::ivec2(0))
        return;
    if (size != shown_.size) {
        shown_.size = size;
        change_view();
    }
    if ((scheduler_->shown() && is_refining()) || show_first())
        return;
    const auto points_at = [&](double max_error) {
        std::uint64_t points = 0;
        for (const PointRun &run : shown_.model->streamed().choose(view_at(max_error)).runs)
            points += run.last - run.first;
        return points;
    };
    const auto step = scheduler_->next(Window::now(), points_at);
    if (!step)
        return;
    const DetailView view = view_at(step->max_error);
    if (step->at_once)
        draw_now(view);
    else if (!drawing_.valid())
        draw_in_background(view);
}

DetailView Pictures::view_at(double max_error) const {
    return shown_.model->view(shown_.camera, shown_.size, max_error);
}

FrameScheduler::Errors Pictures::errors() const {
    const auto of = [&](Motion motion) {
        return max_error_of(shown_.options, shown_.size, shown_.look->options.quality, motion);
    };
    return {.still = of(Motion::still), .moving = of(Motion::moving)};
}

// Chooses what is loaded for a view. Requests what is missing, unless a picture to be saved needs other chunks.
Detail Pictures::choose(const DetailView &view) {
    Detail detail = shown_.model->streamed().choose(view);
    if (!saver_.is_waiting())
        shown_.model->streamed().request(detail.missing);
    return detail;
}

void Pictures::draw_now(const DetailView &view) {
    if (!canvas_ || glm::ivec2(canvas_->width, canvas_->height) != shown_.size)
        canvas_.emplace(shown_.size.x, shown_.size.y);
    const PictureStatistics drawn = shown_.model->draw_now(choose(view), view, shown_.look, *canvas_);
    if (drawn.is_lost && !shown_.is_for_video) {
        canvas_.reset();
        return lost_();
    }
    show_at_once(view.max_error, drawn);
}

// Shows the picture that was drawn before there was a window, if it shows the present view. Returns whether it does.
bool Pictures::show_first() {
    auto first = shown_.model->take_first();
    if (!first || first->view != view_at(errors().still) || first->drawn.is_lost)
        return false;
    canvas_ = std::move(first->pixels);
    show_at_once(first->view.max_error, first->drawn);
    return true;
}

void Pictures::show_at_once(double max_error, const PictureStatistics &drawn) {
    const bool first_of_view = !scheduler_->shown();
    show_picture(max_error, drawn);
    if (first_of_view && notices_.verbose())
        std::cout << "view: " << view_as_options(shown_.camera, shown_.options, shown_.size)
                  << look_as_options(shown_.look->options) << std::endl;
}

void Pictures::draw_in_background(const DetailView &view) {
    drawing_ = background_.post(
        [model = shown_.model, detail = choose(view), view, look = shown_.look, number = view_, memory = memory_] {
            Picture picture{number, view.max_error, memory->take({view.width, view.height}), {}};
            picture.drawn = model->draw_in_background(detail, view, look, picture.pixels);
            return picture;
        });
}

// Shows the picture that was drawn in the background, unless the view has changed.
void Pictures::receive_picture() {
    if (!is_ready(drawing_))
        return;
    Picture picture = drawing_.get();
    if (picture.view == view_ && picture.drawn.is_lost && !shown_.is_for_video)
        lost_();
    if (picture.view == view_) {
        replace_canvas(std::move(picture.pixels));
        show_picture(picture.max_error, picture.drawn);
    }
    full_view_ = 0; // the picture held chunks, maybe of an old view
}

// When to start to refine the picture shown; absent if it is not to be refined, or is already.
std::optional<double> Pictures::refinement_due() const {
    if (!scheduler_ || refinement_ || drawing_.valid() || shown_.is_overwritten || shown_.is_for_video ||
        !draws_fine(shown_.look->options.quality, Motion::still))
        return std::nullopt;
    return scheduler_->refinement_due();
}

// Refines a view that rests, that is shown and whose chunks are there, unless its look asks for fast pictures. To show
// the first picture takes software OpenGL longer than to draw it, and it would share the processors with the
// refinement.
void Pictures::refine() {
    if (refinement_ && !refinement_->is_ready())
        return;
    if (refinement_) {
        Refinement::Picture picture = refinement_->receive();
        if (picture.drawn.is_lost)
            return lost_();
        replace_canvas(std::move(picture.pixels));
        samples_ = picture.samples;
        refinement_->go_on(samples_);
        scheduler_->refined();
        return show_frame(*canvas_, picture.drawn);
    }
    if (const auto when = refinement_due(); !when || Window::now() < *when || window_.is_stale())
        return;
    const DetailView view = view_at(errors().still);
    Detail detail = choose(view);
    waits_for_chunks_ = !detail.missing.empty();
    if (!waits_for_chunks_)
        refinement_ =
            std::make_unique<Refinement>(background_, shown_.model, std::move(detail), view, shown_.look, memory_);
}

void Pictures::replace_canvas(Framebuffer picture) {
    if (canvas_)
        memory_->give(std::move(*canvas_));
    canvas_ = std::move(picture);
}

void Pictures::end_refinement() {
    if (refinement_)
        full_view_ = 0; // the refinement held chunks
    refinement_.reset();
    samples_ = 0;
}

// Shows `canvas_`, which holds a picture of the present view.
void Pictures::show_picture(double max_error, const PictureStatistics &drawn) {
    const double begin = Window::now();
    end_refinement();
    show_frame(*canvas_, drawn);
    camera_ = shown_.camera;
    const double now = Window::now();
    scheduler_->drawn({.max_error = max_error,
                       .points = drawn.drawn.points,
                       .complete = drawn.missing == 0,
                       .seconds = drawn.seconds + now - begin},
                      now);
}

// Reports, once per model, that the chunks which the picture lacks do not fit into the memory allowed.
void Pictures::check_room() {
    if (!shown_.model || shown_.is_overwritten || !scheduler_->shown() || scheduler_->complete() || scheduler_->due() ||
        drawing_.valid() || saver_.is_waiting() || view_ == full_view_ || shown_.model->streamed().is_loading())
        return;
    if (choose(view_at(errors().still)).missing.size() != drawn_.missing)
        return scheduler_->arrived(true);
    full_view_ = view_;
    if (std::exchange(has_reported_memory_, true))
        return;
    const Error error = with_advice(notices_.program(), {ErrorCode::memory, 0,
                                                         "the picture needs more memory than allowed (" +
                                                             std::to_string(shown_.options.load.max_memory >> 20) +
                                                             " MiB) and is coarser"});
    notices_.fail(shown_.model->path(), error);
    notices_.notify(file_name(shown_.model->path()) + ": " + error.message, true);
}

void Pictures::save() {
    if (shown_.has_picture())
        saver_.add(shown_.model, view_at(errors().still), shown_.look);
}

void Pictures::receive_saves(bool all) {
    for (const Result<std::string> &saved : saver_.take_done(all)) {
        notices_.report_saved(saved);
        full_view_ = 0; // the saved picture held chunks
    }
}

void Pictures::show_frame(const Framebuffer &pixels, const PictureStatistics &drawn) {
    presenter_.upload(pixels);
    drawn_ = drawn;
    window_.invalidate();
}

std::optional<MeasuredPoint> Pictures::pick(glm::dvec2 pixel) const {
    if (!shown_.model || !canvas_ || glm::ivec2(canvas_->width, canvas_->height) != shown_.size)
        return std::nullopt;
    const PictureSpace space = shown_.space(camera_);
    const auto point = pbm::pick(*canvas_, space, glm::ivec2(glm::floor(pixel)));
    if (!point)
        return std::nullopt;
    const Grid &grid = shown_.model->grid();
    return MeasuredPoint{point->place, point_uncertainty(grid.voxel_size_at(drawn_.drawn.level),
                                                         grid.voxel_size_at(drawn_.coarsest_level), drawn_.error,
                                                         space.pixel_size(point->depth))};
}

} // namespace pbm
