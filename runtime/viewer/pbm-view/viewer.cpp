#include "viewer.h"

#include "window/view_text.h"

#include "command_line/command_line.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <utility>

namespace pbm {
namespace {

constexpr double kNoticeTime = 4, kProblemTime = 10;
constexpr double kBusyPoll = 0.1; // seconds; covers a lost wake-up while other threads work

// The camera of the command line is for the model of the command line only.
void forget_camera(ViewOptions &options) { options.position = options.focal_point = options.view_up = std::nullopt; }

} // namespace

Viewer::Viewer(const Arguments &arguments, Window &window, ThreadPool &background, Start start)
    : program_(start.program), options_(arguments.view), min_fps_(arguments.min_fps), window_(window),
      background_(background), start_(start.time), context_(Window::now()), overlay_(window.content_scale()),
      loading_(std::move(start.loading)), loading_path_(std::move(start.path)), mode_(arguments.camera_mode),
      video_(std::move(start.video)), video_options_(arguments.choice.video), saver_(background),
      show_frame_time_(arguments.show_frame_time), show_panel_(arguments.show_panel) {
    background_.set_wake(Window::wake);
}

Viewer::~Viewer() {
    background_.set_wake({});
    destroy_in(background_, std::move(model_));
}

int Viewer::run() {
    while (!quit_ && !window_.close_requested()) {
        for (const Event &event : window_.wait(timeout()))
            std::visit([this](const auto &e) { handle(e); }, event);
        if (quit_)
            break;
        if (const glm::dvec2 steps = arrows_.take_steps(Window::now()); model_ && steps != glm::dvec2(0))
            move_to(after_arrows(camera_, mode_, steps, model_->bounds().radius));
        if (const auto failed = receive_model())
            return *failed;
        receive_chunks();
        receive_saves(false);
        receive_picture();
        draw_due_picture();
        refine();
        serve_saver();
        check_room();
        if (video_ || recording_)
            record();
        if (!notice_.text.empty() && Window::now() >= notice_.until) {
            notice_ = {};
            stale_ = true;
        }
        if (stale_)
            present();
    }
    if (recording_ || video_) {
        recording_.reset();
        video_.reset();
        std::cout << "stopped: " << video_options_.output << " was not written" << std::endl;
    }
    receive_saves(true);
    if (verbose())
        std::cout << "frames: " << frames_ << std::endl;
    return exit_code_;
}

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

void Viewer::move_to(const Camera &camera) {
    if (!is_usable(camera) || recording_)
        return;
    camera_ = camera;
    change_view();
}

void Viewer::change_view() {
    ++view_;
    end_refinement();
    scheduler_->view_changed(Window::now());
}

// The default camera for the window's size, or for its last size while it has no pixels.
Result<Camera> Viewer::first_camera(const ShownModel &model) const {
    glm::ivec2 size = picture_size();
    if (size == glm::ivec2(0))
        size = view_size_ == glm::ivec2(0) ? options_.resolution : view_size_;
    return choose_camera(options_, model.bounds(), model.grid().up, size);
}

void Viewer::reset_camera() {
    if (!model_)
        return;
    if (const auto camera = first_camera(*model_))
        move_to(*camera);
}

void Viewer::toggle_panel() {
    show_panel_ = !show_panel_;
    if (show_panel_ && mouse_)
        overlay_.point(*mouse_ * static_cast<double>(window_.framebuffer_size().y));
    update_panel();
}

// Passes the pending input to the panel.
void Viewer::update_panel() {
    if (!model_ || !show_panel_ || recording_ || picture_size() == glm::ivec2(0))
        return;
    const bool had_mouse = overlay_.wants_mouse();
    Look look = *look_;
    bool changed = false;
    overlay_.update(window_.framebuffer_size(), [&] { changed = build_panel(look) || changed; });
    stale_ = stale_ || had_mouse || overlay_.wants_mouse();
    if (changed)
        change_look(std::move(look));
}

bool Viewer::build_panel(Look &look) {
    return panel_.build(look, window_.framebuffer_size(), static_cast<float>(window_.content_scale()));
}

void Viewer::change_look(Look look) {
    look_ = std::make_shared<Look>(std::move(look));
    change_view();
}

void Viewer::draw_due_picture() {
    const glm::ivec2 size = picture_size();
    if (recording_ || !model_ || size == glm::ivec2(0))
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

// Chooses what is loaded for a view. Requests what is missing, unless a picture to be saved needs other chunks.
Detail Viewer::choose(const DetailView &view) {
    Detail detail = model_->streamed().choose(view);
    if (!saver_.is_waiting())
        model_->streamed().request(detail.missing);
    return detail;
}

void Viewer::draw_now(const DetailView &view) {
    if (!canvas_ || glm::ivec2(canvas_->width, canvas_->height) != view_size_)
        canvas_.emplace(view_size_.x, view_size_.y, false);
    const bool first_of_view = !scheduler_->shown();
    const PictureStatistics drawn = model_->draw_now(choose(view), view, look_, *canvas_);
    show_picture(*canvas_, view.max_error, drawn);
    if (first_of_view && verbose())
        std::cout << "view: " << view_as_options(camera_, options_.view_angle, view_size_)
                  << look_as_options(look_->options) << std::endl;
}

void Viewer::draw_in_background(const DetailView &view) {
    drawing_ = background_.post([model = model_, detail = choose(view), view, look = look_, number = view_] {
        Picture picture{number, view.max_error, Framebuffer(view.width, view.height, false), {}};
        picture.drawn = model->draw_in_background(detail, view, look, picture.pixels);
        return picture;
    });
}

// Shows the picture that was drawn in the background, unless the view has changed.
void Viewer::receive_picture() {
    if (!is_ready(drawing_))
        return;
    const Picture picture = drawing_.get();
    if (picture.view == view_)
        show_picture(picture.pixels, picture.max_error, picture.drawn);
    full_view_ = 0; // the picture held chunks, maybe of an old view
}

// Refines a view at rest at full detail, if its look asks for fine pictures.
void Viewer::refine() {
    if (refinement_) {
        const auto picture = refinement_->receive();
        if (!picture)
            return;
        presenter_.upload(picture->pixels);
        drawn_ = picture->drawn;
        samples_ = picture->samples;
        stale_ = true;
        return;
    }
    if (!scheduler_ || !scheduler_->complete() || samples_ > 0 || recording_ || video_ ||
        look_->options.quality != Quality::fine)
        return;
    const DetailView view = model_->view(camera_, view_size_, options_.max_error);
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

void Viewer::show_picture(const Framebuffer &pixels, double max_error, const PictureStatistics &drawn) {
    const double begin = Window::now();
    end_refinement();
    presenter_.upload(pixels);
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
    if (!model_ || !scheduler_->shown() || scheduler_->complete() || scheduler_->due() || drawing_.valid() ||
        saver_.is_waiting() || view_ == full_view_ || model_->streamed().is_loading())
        return;
    if (choose(model_->view(camera_, view_size_, options_.max_error)).missing.size() != drawn_.missing)
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
        saver_.add(model_, model_->view(camera_, view_size_, options_.max_error), look_);
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
                                                 up_direction(model_->grid().up));
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
                std::cout << "view: " << view_as_options(camera, options_.view_angle, options_.resolution)
                          << look_as_options(look_->options) << std::endl;
        });
    if (!added)
        end_recording(added);
}

void Viewer::end_recording(const Status &status) {
    recording_.reset();
    quit_ = true;
    if (!status)
        exit_code_ = command_line::fail(program_, video_options_.output, status.error());
    else if (options_.verbosity != command_line::Verbosity::quiet && video_options_.output != "-")
        std::cout << "saved " << video_options_.output << std::endl;
}

void Viewer::notify(std::string text, bool is_problem) {
    notice_ = {std::move(text), is_problem, Window::now() + (is_problem ? kProblemTime : kNoticeTime)};
    stale_ = true;
}

// Seconds until something is due without further events; absent: nothing is due.
std::optional<double> Viewer::timeout() const {
    const double now = Window::now();
    std::optional<double> at;
    const auto no_later_than = [&](std::optional<double> time) {
        if (time)
            at = at ? std::min(*at, *time) : *time;
    };
    if (stale_ || recording_)
        no_later_than(now);
    if (!notice_.text.empty())
        no_later_than(notice_.until);
    if (background_.busy() || (model_ && model_->streamed().is_loading()))
        no_later_than(now + kBusyPoll);
    no_later_than(arrows_.next_step(now));
    // A fine picture that is due waits for the one in progress.
    if (scheduler_ && picture_size() != glm::ivec2(0) && !(scheduler_->shown() && drawing_.valid()))
        no_later_than(scheduler_->due());
    return at ? std::optional(std::max(0.0, *at - now)) : std::nullopt;
}

// Size of the window in pixels, clamped to what OpenGL can show; 0 x 0 if there are none.
glm::ivec2 Viewer::picture_size() const {
    const glm::ivec2 size = window_.framebuffer_size();
    if (size.x <= 0 || size.y <= 0)
        return glm::ivec2(0);
    return glm::min(size, std::min(presenter_.max_edge(), kMaxPictureEdge));
}

OverlayText Viewer::overlay_text() const {
    OverlayText text;
    if (loading_.valid())
        text.middle = "Loading " + file_name(loading_path_) + " ...";
    if (show_help_) {
        text.help_title = std::string(program_) + " " PBM_VERSION;
        text.help = help_rows(mode_);
    }
    if (recording_)
        text.corner = "Recording frame " + std::to_string(recording_->frame()) + " of " +
                      std::to_string(recording_->video().frames) + "   Escape stops";
    else if (show_frame_time_ && scheduler_ && scheduler_->shown())
        text.corner = cost_text(drawn_, model_->depth(), view_size_);
    text.notice = notice_.text;
    text.notice_is_problem = notice_.is_problem;
    return text;
}

void Viewer::present() {
    const glm::ivec2 size = window_.framebuffer_size();
    stale_ = false;
    if (size.x <= 0 || size.y <= 0)
        return;
    presenter_.draw(size, look_ ? look_->options.render.background : options_.look.render.background);
    const bool with_panel = show_panel_ && look_ && !recording_;
    if (const OverlayText text = overlay_text(); with_panel || !text.empty())
        overlay_.draw(size, text, with_panel ? [&] {
            Look look = *look_;
            if (build_panel(look))
                change_look(std::move(look));
        } : Overlay::Build());
    window_.swap();
    ++frames_;
    if (verbose())
        report_frame();
}

void Viewer::report_frame() {
    std::cout << "frame " << frames_ << ": ";
    if (!scheduler_ || !scheduler_->shown()) {
        std::cout << "no picture yet" << std::endl;
        return;
    }
    std::cout << cost_line(drawn_, model_->depth(), view_size_, model_->streamed().statistics())
              << (samples_ > 0 ? "fine, " + std::to_string(samples_) + " of " + std::to_string(look_->options.samples) +
                                     " samples"
                  : scheduler_->complete() ? "exact"
                                           : "coarse, " + std::to_string(drawn_.missing) + " chunks missing")
              << '\n';
    const auto report_time = [&](const char *what) {
        const std::chrono::duration<double> since_start = Clock::now() - start_;
        std::cout << what << " picture: " << milliseconds(since_start.count()) << " after the start, "
                  << milliseconds(Window::now() - context_) << " after the OpenGL context\n";
    };
    if (std::exchange(first_picture_, false))
        report_time("first");
    if (scheduler_->complete() && std::exchange(exact_picture_, false))
        report_time("exact");
    std::cout << std::flush;
}

} // namespace pbm
