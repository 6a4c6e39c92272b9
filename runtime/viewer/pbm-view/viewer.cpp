#include "viewer.h"

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

constexpr double kDoubleClick = 0.4;       // seconds
constexpr double kDoubleClickReach = 0.01; // picture heights
constexpr double kNoticeTime = 4, kProblemTime = 10;
constexpr double kBusyPoll = 0.1; // seconds; should a wake-up ever be lost while other threads work

std::string file_name(const std::string &path) { return std::filesystem::path(path).filename().string(); }

// 1234567 as 1,234,567.
std::string grouped(std::uint64_t number) {
    const std::string digits = std::to_string(number);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && (digits.size() - i) % 3 == 0)
            text += ',';
        text += digits[i];
    }
    return text;
}

std::string milliseconds(double seconds) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.1f ms", 1e3 * seconds);
    return text.data();
}

std::string size_text(glm::ivec2 size) { return std::to_string(size.x) + "x" + std::to_string(size.y); }

// Where to stand for the model named on the command line says nothing about others.
void forget_camera(ViewOptions &options) { options.position = options.focal_point = options.view_up = std::nullopt; }

std::string pixels(double error) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.2f pixels", error);
    return text.data();
}

std::string levels(const PictureStatistics &picture) {
    const std::string finest = std::to_string(picture.drawn.level);
    return picture.coarsest_level == picture.drawn.level
               ? "level " + finest
               : "levels " + std::to_string(picture.coarsest_level) + " to " + finest;
}

std::vector<OverlayRow> help_rows(CameraMode mode) {
    std::vector<OverlayRow> rows;
    if (mode == CameraMode::orbit)
        rows = {{"Drag, Left, Right", "turn the model"}, {"Wheel, right drag, Up, Down", "change the distance"}};
    else
        rows = {{"Drag", "turn the camera"},
                {"Wheel, Up, Down", "fly along the view direction"},
                {"Left, Right", "fly sideways"}};
    const std::vector<OverlayRow> common{{"Middle drag, Shift + drag", "move the model in the picture"},
                                         {"W, A, S, D", "as the arrow keys"},
                                         {"F, Enter, double click", "back to the first view"},
                                         {"C", mode == CameraMode::orbit ? "flying camera" : "target camera"},
                                         {"Space, F12", "save a picture"},
                                         {"F1, H", "this help"},
                                         {"F2", "what a picture costs"},
                                         {"F11", "full screen"},
                                         {"Drop a file", "open it"},
                                         {"Escape", "quit"}};
    rows.insert(rows.end(), common.begin(), common.end());
    return rows;
}

} // namespace

Viewer::Viewer(std::string_view program, const Arguments &arguments, Window &window, BackgroundThread &background,
               const std::string &path, Loading loading, Clock::time_point start)
    : program_(program), options_(arguments.view), min_fps_(arguments.min_fps), window_(window),
      background_(background), start_(start), context_(Window::now()), overlay_(window.content_scale()),
      loading_(std::move(loading)), loading_path_(path), mode_(arguments.camera_mode), saver_(background),
      show_frame_time_(arguments.show_frame_time) {
    background_.set_wake(Window::wake);
}

Viewer::~Viewer() {
    background_.set_wake({});
    let_go(background_, std::move(model_));
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
        serve_saver();
        check_room();
        if (!notice_.text.empty() && Window::now() >= notice_.until) {
            notice_ = {};
            stale_ = true;
        }
        if (stale_)
            present();
    }
    receive_saves(true);
    if (verbose())
        std::cout << "frames: " << frames_ << std::endl;
    return 0;
}

void Viewer::handle(const KeyEvent &event) {
    const auto arrow = [&](Arrow which) {
        if (event.pressed)
            arrows_.press(which, Window::now());
        else
            arrows_.release(which, Window::now());
    };
    switch (event.key) {
    case Key::left: return arrow(Arrow::left);
    case Key::right: return arrow(Arrow::right);
    case Key::up: return arrow(Arrow::up);
    case Key::down: return arrow(Arrow::down);
    default: break;
    }
    if (!event.pressed)
        return;
    switch (event.key) {
    case Key::quit: quit_ = true; break;
    case Key::save: save(); break;
    case Key::reset: reset_camera(); break;
    case Key::help: show_help_ = !show_help_; break;
    case Key::frame_time: show_frame_time_ = !show_frame_time_; break;
    case Key::full_screen: window_.toggle_full_screen(); break;
    case Key::switch_camera:
        mode_ = mode_ == CameraMode::orbit ? CameraMode::fly : CameraMode::orbit;
        notify(mode_ == CameraMode::orbit ? "Target camera" : "Flying camera", false);
        break;
    default: break;
    }
    stale_ = true;
}

void Viewer::handle(const ButtonEvent &event) {
    if (!event.pressed) {
        if (dragging_ == event.button)
            dragging_.reset();
        return;
    }
    if (dragging_)
        return;
    dragging_ = event.button;
    drag_with_shift_ = event.shift;
    if (event.button != MouseButton::left || !mouse_)
        return;
    const double now = Window::now();
    if (now - last_click_ < kDoubleClick && glm::length(*mouse_ - last_click_place_) < kDoubleClickReach) {
        reset_camera();
        last_click_ = -1; // a third click is the first of another pair
        return;
    }
    last_click_ = now;
    last_click_place_ = *mouse_;
}

void Viewer::handle(const MoveEvent &event) {
    const glm::dvec2 moved = event.position - mouse_.value_or(event.position);
    mouse_ = event.position;
    if (!dragging_ || !model_ || moved == glm::dvec2(0))
        return;
    Drag drag = Drag::turn;
    if (*dragging_ == MouseButton::middle || (*dragging_ == MouseButton::left && drag_with_shift_))
        drag = Drag::pan;
    else if (*dragging_ == MouseButton::right)
        drag = Drag::distance;
    move_to(after_drag(camera_, mode_, drag, {moved.x, -moved.y}, model_->bounds().radius));
}

void Viewer::handle(const WheelEvent &event) {
    if (model_ && event.notches != 0)
        move_to(after_wheel(camera_, mode_, event.notches, model_->bounds().radius));
}

void Viewer::handle(const DropEvent &event) {
    // One after the other: the model that the program was started with is shown or refused whatever is dropped
    // meanwhile.
    if (loading_.valid())
        dropped_path_ = event.path;
    else
        open(event.path);
}

void Viewer::handle(const RefreshEvent & /*event*/) { stale_ = true; }

// Takes the model that was loaded, if one was. The exit code if it is the first one and cannot be shown.
std::optional<int> Viewer::receive_model() {
    if (!is_ready(loading_))
        return std::nullopt;
    auto loaded = loading_.get();
    const std::string path = std::exchange(loading_path_, "");
    stale_ = true;
    if (!loaded) {
        const Error error = with_advice(program_, loaded.error());
        const int code = command_line::fail(program_, path, error); // into the log, too
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
    let_go(background_, std::exchange(model_, std::move(loaded)));
    camera_ = *camera;
    if (picture_size() != glm::ivec2(0))
        view_size_ = picture_size();
    ++view_;
    scheduler_.emplace(options_.max_error, min_fps_);
    has_told_of_room_ = false;
    window_.set_title(file_name(model_->path()) + " - " + std::string(program_) + " (F1: help)");
    return {};
}

// Chunks that were loaded make better pictures; what is damaged is named, and coarser levels stay in its place.
void Viewer::receive_chunks() {
    if (!model_)
        return;
    if (model_->take_arrivals())
        scheduler_->arrived(!model_->streamed().is_loading());
    const std::vector<Error> errors = model_->streamed().take_errors();
    for (const Error &error : errors)
        command_line::fail(program_, model_->path(), with_advice(program_, error));
    if (!errors.empty())
        notify(file_name(model_->path()) + ": " + with_advice(program_, errors.front()).message, true);
}

void Viewer::move_to(const Camera &camera) {
    if (!is_usable(camera))
        return;
    camera_ = camera;
    change_view();
}

void Viewer::change_view() {
    ++view_;
    scheduler_->view_changed(Window::now());
}

// For the window as it is; one without pixels has the size it had.
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

void Viewer::draw_due_picture() {
    const glm::ivec2 size = picture_size();
    if (!model_ || size == glm::ivec2(0))
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
    else if (!refining_.valid())
        draw_in_background(view);
}

// What there is of a picture; what it lacks is requested, unless a picture that is to be saved needs other chunks.
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
    const PictureStatistics drawn = model_->draw_now(choose(view), view, *canvas_);
    show_picture(*canvas_, view.max_error, drawn);
    if (first_of_view && verbose())
        std::cout << "view: " << view_as_options(camera_, options_.view_angle, view_size_) << std::endl;
}

void Viewer::draw_in_background(const DetailView &view) {
    refining_ = background_.post([model = model_, detail = choose(view), view, number = view_] {
        Picture picture{number, view.max_error, Framebuffer(view.width, view.height, false), {}};
        picture.drawn = model->draw_in_background(detail, view, picture.pixels);
        return picture;
    });
}

// Shows the picture that was drawn in the background, unless the view is another by now.
void Viewer::receive_picture() {
    if (!is_ready(refining_))
        return;
    const Picture picture = refining_.get();
    if (picture.view == view_)
        show_picture(picture.pixels, picture.max_error, picture.drawn);
    full_view_ = 0; // it held chunks of a view that may be past
}

void Viewer::show_picture(const Framebuffer &pixels, double max_error, const PictureStatistics &drawn) {
    const double begin = Window::now();
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

// Says so, once for every model, if what the picture lacks does not fit into the memory allowed.
void Viewer::check_room() {
    if (!model_ || !scheduler_->shown() || scheduler_->complete() || scheduler_->due() || refining_.valid() ||
        saver_.is_waiting() || view_ == full_view_ || model_->streamed().is_loading())
        return;
    if (choose(model_->view(camera_, view_size_, options_.max_error)).missing.size() != drawn_.missing)
        return scheduler_->arrived(true);
    full_view_ = view_;
    if (std::exchange(has_told_of_room_, true))
        return;
    const Error error =
        with_advice(program_, {ErrorCode::memory, 0,
                               "the picture needs more memory than allowed (" +
                                   std::to_string(options_.load.max_memory >> 20) + " MiB) and is coarser"});
    command_line::fail(program_, model_->path(), error);
    notify(file_name(model_->path()) + ": " + error.message, true);
}

// Draws the view once more, exact, whatever is shown at the moment.
void Viewer::save() {
    if (model_ && view_size_ != glm::ivec2(0))
        saver_.add(model_, model_->view(camera_, view_size_, options_.max_error));
}

// Last of all that chooses chunks: those that the last view needs are not let go.
void Viewer::serve_saver() {
    if (!saver_.is_waiting())
        return;
    saver_.serve();
    if (!saver_.is_waiting() && scheduler_)
        scheduler_->arrived(true);
}

// Tells what became of pictures that were to be saved; waits for those not yet done if `all` are wanted.
void Viewer::receive_saves(bool all) {
    for (const Result<std::string> &saved : saver_.take_done(all)) {
        if (saved && options_.verbosity != command_line::Verbosity::quiet)
            std::cout << "saved " << *saved << std::endl;
        if (!saved)
            command_line::fail(program_, "", saved.error());
        notify(saved ? "Saved " + std::filesystem::absolute(*saved).string() : saved.error().message, !saved);
        full_view_ = 0; // it held chunks
    }
}

void Viewer::notify(std::string text, bool is_problem) {
    notice_ = {std::move(text), is_problem, Window::now() + (is_problem ? kProblemTime : kNoticeTime)};
    stale_ = true;
}

// How long nothing is to be done unless something happens.
std::optional<double> Viewer::timeout() const {
    const double now = Window::now();
    std::optional<double> at;
    const auto no_later_than = [&](std::optional<double> time) {
        if (time)
            at = at ? std::min(*at, *time) : *time;
    };
    if (stale_)
        no_later_than(now);
    if (!notice_.text.empty())
        no_later_than(notice_.until);
    if (background_.busy() || (model_ && model_->streamed().is_loading()))
        no_later_than(now + kBusyPoll);
    no_later_than(arrows_.next_step(now));
    // A fine picture that is due waits for the one under way.
    if (scheduler_ && picture_size() != glm::ivec2(0) && !(scheduler_->shown() && refining_.valid()))
        no_later_than(scheduler_->due());
    return at ? std::optional(std::max(0.0, *at - now)) : std::nullopt;
}

// Pixels of the window, as far as OpenGL can show them; 0 x 0 if there are none.
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
    if (show_frame_time_ && scheduler_ && scheduler_->shown())
        text.corner = milliseconds(drawn_.seconds) + "   " + pixels(drawn_.error) + "   " + levels(drawn_) + " of " +
                      std::to_string(model_->depth()) + "   " + grouped(drawn_.drawn.drawn_points) + " of " +
                      grouped(drawn_.drawn.points) + " points   " + size_text(view_size_);
    text.notice = notice_.text;
    text.notice_is_problem = notice_.is_problem;
    return text;
}

void Viewer::present() {
    const glm::ivec2 size = window_.framebuffer_size();
    stale_ = false;
    if (size.x <= 0 || size.y <= 0)
        return;
    presenter_.draw(size, options_.render.background);
    if (const OverlayText text = overlay_text(); !text.empty())
        overlay_.draw(size, text);
    window_.swap();
    ++frames_;
    if (verbose())
        tell_frame();
}

void Viewer::tell_frame() {
    std::cout << "frame " << frames_ << ": ";
    if (!scheduler_ || !scheduler_->shown()) {
        std::cout << "no picture yet" << std::endl;
        return;
    }
    const StreamingStatistics cost = model_->streamed().statistics();
    std::cout << "error " << pixels(drawn_.error) << ", " << levels(drawn_) << " of " << model_->depth() << ", "
              << drawn_.drawn.drawn_points << " of " << drawn_.drawn.points << " points drawn, "
              << milliseconds(drawn_.seconds) << ", " << size_text(view_size_) << ", " << cost.bytes_read
              << " bytes read, " << cost.points_decoded << " points decoded, "
              << (scheduler_->complete() ? "exact" : "coarse, " + std::to_string(drawn_.missing) + " chunks missing")
              << '\n';
    const auto tell_time = [&](const char *what) {
        const std::chrono::duration<double> since_start = Clock::now() - start_;
        std::cout << what << " picture: " << milliseconds(since_start.count()) << " after the start, "
                  << milliseconds(Window::now() - context_) << " after the OpenGL context\n";
    };
    if (std::exchange(first_picture_, false))
        tell_time("first");
    if (scheduler_->complete() && std::exchange(exact_picture_, false))
        tell_time("exact");
    std::cout << std::flush;
}

} // namespace pbm
