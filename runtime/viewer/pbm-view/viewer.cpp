#include "viewer.h"

#include "window/desktop.h"

#include "window/view_text.h"

#include "command_line/command_line.h"
#include "viewer/opening/explanation.h"

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
constexpr double kFade = 1, kFadeStep = 0.05; // of the hint of the first start
constexpr double kBusyPoll = 0.1;             // seconds; covers a lost wake-up while other threads work

} // namespace

Viewer::Viewer(const Arguments &arguments, Window &window, Workers &workers, Start start)
    : program_(start.program), options_(arguments.view), view_angle_(arguments.view.view_angle),
      min_fps_(arguments.min_fps), window_(window), workers_(workers), background_(workers.background),
      start_(start.time), context_(Window::now()), overlay_(window.content_scale()), scans_(arguments.scans),
      files_(std::move(start.files)), is_sample_(start.is_sample), opening_(std::move(start.opening)),
      mode_(arguments.camera_mode), video_(std::move(start.video)), video_options_(arguments.choice.video),
      saver_(background_), panel_(arguments.theme),
      shadows_(workers.baking, arguments.view.load.threads, arguments.view.load.max_memory),
      show_frame_time_(arguments.show_frame_time), show_panel_(arguments.show_panel) {
    for (ThreadPool *const pool : {&workers_.helpers, &workers_.idle, &workers_.background, &workers_.baking})
        pool->set_wake(Window::wake);
    if (start.problem) {
        problem_code_ = exit_code(start.problem->code);
        start_page_.set_problem({{files_.empty() ? "" : file_name(files_.current()), explain(*start.problem)}});
    }
    if ((is_sample_ || start.problem) && !video_)
        show_start_page();
    if (arguments.theme == Theme::desktop)
        asks_desktop_ = workers_.helpers.post(desktop_prefers_light);
}

Viewer::~Viewer() {
    stop_.request_stop();
    stop_search_.request_stop();
    if (watch_)
        watch_->stop();
    opening_.reset();
    for (ThreadPool *const pool : {&workers_.helpers, &workers_.idle, &workers_.background, &workers_.baking})
        pool->set_wake({});
    shadows_.show(nullptr);
    destroy_in(background_, std::move(model_));
}

int Viewer::run() {
    while (!quit_) {
        update_theme();
        for (const Event &event : window_.wait(timeout()))
            std::visit([this](const auto &e) { handle(e); }, event);
        if (window_.close_requested())
            request_quit();
        if (quit_)
            break;
        if (const glm::dvec2 steps = arrows_.take_steps(Window::now()); model_ && steps != glm::dvec2(0))
            move_to(after_arrows(camera_, steering(), steps));
        follow_glide();
        if (const auto failed = receive_model())
            return *failed;
        receive_dialog();
        follow_file();
        receive_chunks();
        receive_saves(false);
        receive_scene_save(false);
        receive_picture();
        serve_shadows();
        draw_due_picture();
        refine();
        serve_saver();
        check_room();
        search_damage();
        if (video_ || recording_)
            record();
        if (!notice_.text.empty() && Window::now() >= notice_.until) {
            notice_ = {};
            stale_ = true;
        }
        if (hint_until_ && hint_opacity() < 1) {
            stale_ = true;
            if (hint_opacity() == 0)
                hint_until_.reset();
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
    receive_scene_save(true);
    if (verbose())
        std::cout << "frames: " << frames_ << std::endl;
    return model_ ? exit_code_ : problem_code_;
}

// Moves the camera by input, which ends a glide.
void Viewer::move_to(const Camera &camera) {
    glide_.reset();
    set_camera(camera);
}

void Viewer::set_camera(const Camera &camera) {
    if (!is_usable(camera) || recording_ || overwritten_)
        return;
    camera_ = camera;
    change_view();
}

void Viewer::change_view() {
    ++view_;
    end_refinement();
    scheduler_->view_changed(Window::now(), errors());
}

// The default camera for the window's size, or for its last size while it has no pixels.
Result<Camera> Viewer::first_camera(const ShownModel &model) const {
    glm::ivec2 size = picture_size();
    if (size == glm::ivec2(0))
        size = view_size_ == glm::ivec2(0) ? options_.resolution : view_size_;
    return video_ ? choose_turntable(options_, model.extent(), model.grid(), size)
                  : choose_camera(options_, model.extent(), model.grid(), size);
}

void Viewer::reset_camera() {
    if (!model_)
        return;
    if (const auto camera = first_camera(*model_))
        glide_to(*camera);
}

// Makes the next axis point up, in the order y, z, x, and goes back to the first view. Default lights turn with it.
void Viewer::turn_up_axis() {
    if (!model_ || recording_)
        return;
    const UpAxis before = up_of(options_, model_->grid());
    const UpAxis up = before == UpAxis::y ? UpAxis::z : before == UpAxis::z ? UpAxis::x : UpAxis::y;
    forget_camera(options_);
    if (up != model_->grid().up)
        options_.up = up;
    Look look = *look_;
    look.appearance.up = up;
    if (look.appearance.lights == default_lights(before) && model_->parameters().lights.empty())
        look.appearance.lights = default_lights(up);
    look_ = std::make_shared<Look>(std::move(look));
    notify("Up axis: " + word_of(up), false);
    if (const auto camera = first_camera(*model_)) {
        axis_ = camera->up;
        move_to(*camera);
    }
}

void Viewer::update_theme() {
    if (is_ready(asks_desktop_))
        desktop_is_light_ = asks_desktop_.get();
    const bool light = panel_.theme() == Theme::light || (panel_.theme() == Theme::desktop && desktop_is_light_);
    stale_ = overlay_.set_light_theme(light) || stale_;
}

// 1, and down to 0 while the hint fades.
double Viewer::hint_opacity() const {
    return hint_until_ ? std::clamp((*hint_until_ - Window::now()) / kFade, 0.0, 1.0) : 0;
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
    if (stale_ || recording_ || glide_)
        no_later_than(now);
    if (!notice_.text.empty())
        no_later_than(notice_.until);
    no_later_than(shadows_.due());
    if (hint_until_)
        no_later_than(hint_opacity() < 1 ? now + kFadeStep : *hint_until_ - kFade);
    if (background_.busy() || workers_.baking.busy() || opening_ || dialog_.valid() || search_.valid() ||
        (model_ && model_->streamed().is_loading()))
        no_later_than(now + kBusyPoll);
    no_later_than(arrows_.next_step(now));
    if (overwritten_) { // no picture is due
        if (!opening_ && !scene_save_.valid())
            no_later_than(overwritten_->next_look);
        return at ? std::optional(std::max(0.0, *at - now)) : std::nullopt;
    }
    // A refinement that is overdue waits for chunks, which wake the window.
    if (const auto refinement = refinement_due(); refinement && *refinement > now)
        no_later_than(refinement);
    // A fine picture that is due waits for the one in progress.
    if (scheduler_ && picture_size() != glm::ivec2(0) && !(scheduler_->shown() && drawing_.valid()))
        no_later_than(scheduler_->due());
    return at ? std::optional(std::max(0.0, *at - now)) : std::nullopt;
}

// Size of the window in pixels beside a docked panel, clamped to what OpenGL can show; 0 x 0 if there are none.
glm::ivec2 Viewer::picture_size() const {
    glm::ivec2 size = window_.framebuffer_size();
    if (has_panel())
        size.x -= Panel::docked_width(size, static_cast<float>(window_.content_scale()));
    if (size.x <= 0 || size.y <= 0)
        return glm::ivec2(0);
    return glm::min(size, std::min(presenter_.max_edge(), kMaxPictureEdge));
}

OverlayText Viewer::overlay_text() const {
    OverlayText text;
    if (const auto progress = opening_ ? opening_->progress() : std::nullopt) {
        text.middle =
            "Building the model of " + file_name(opening_->path()) + ": " + progress->step + "\nEscape cancels";
        text.progress = progress->done;
    } else if (opening_) {
        text.middle = "Loading " + file_name(opening_->path()) + " ...";
    }
    if (question_) {
        text.middle = question_->text;
    } else if (show_help_) {
        text.help_title = std::string(program_) + " " PBM_VERSION;
        text.help = help_rows(mode_);
    }
    if (recording_)
        text.corner = "Recording frame " + std::to_string(recording_->frame()) + " of " +
                      std::to_string(recording_->video().frames) + "   Escape stops";
    else if (show_frame_time_ && scheduler_ && scheduler_->shown())
        text.corner = cost_text(drawn_, model_->depth(), view_size_);
    if (model_ && !recording_)
        text.drawing = measure_drawing();
    if (show_clip_handles_ && model_ && !recording_)
        add_clip_handles(text.drawing);
    if (raking_)
        text.status = "Drag: the light comes from where the pointer is";
    else if (std::string status = file_status(); !status.empty())
        text.status = std::move(status);
    else if (scene_save_.valid())
        text.status = "Saving " + file_name(model_->path()) + " ...";
    else if (hint_until_)
        text.status = "F1: help    Tab: panel", text.status_opacity = hint_opacity();
    else if (const auto light = shadows_.baking(); light && look_)
        text.status = "Baking shadows of " + light_name(look_->appearance.lights[*light], *light) + " ...";
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
    if (const OverlayText text = overlay_text(); has_windows() || !text.empty()) {
        std::optional<Look> changed;
        overlay_.draw(size, picture_size(), text, has_windows() ? [&] { build_windows(changed); } : Overlay::Build());
        if (changed)
            change_look(std::move(*changed));
    }
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
                  : glide_                 ? "gliding"
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
