#include "viewer.h"

#include "viewer/pbm-view/window/view_text.h"

#include <algorithm>
#include <iostream>
#include <utility>

namespace pbm {
namespace {

constexpr double kFade = 1, kFadeStep = 0.05; // seconds, of the hint of the first start
constexpr double kBusyPoll = 0.1;             // seconds; covers a lost wake-up while other threads work

} // namespace

Viewer::Viewer(const Arguments &arguments, Window &window, Workers &workers, Start start)
    : window_(window), workers_(workers), frame_log_(start.time), shown_{.options = arguments.view},
      notices_(start.program, arguments.view.verbosity, window),
      pictures_(shown_, notices_, window, workers.background, arguments.min_fps, [this] { hold_picture(); }),
      navigator_(shown_, pictures_, notices_, arguments.camera_mode),
      edits_(shown_, pictures_, notices_, window, workers.baking), tools_(shown_, navigator_, notices_, window),
      opener_(workers.helpers, arguments.scans, std::move(start.files), std::move(start.opening)),
      is_sample_(start.is_sample), overlay_(window.content_scale()), panel_(arguments.theme),
      show_frame_time_(arguments.show_frame_time), show_panel_(arguments.show_panel) {
    workers_.set_wake(Window::wake);
    if (start.video)
        recording_ = std::make_unique<Recording>(shown_, std::move(*start.video), arguments.choice.video);
    if (start.problem) {
        problem_code_ = exit_code(start.problem->code);
        const std::string name = opener_.files().empty() ? "" : file_name(opener_.files().current());
        start_page_.set_problem({{name, explain(*start.problem)}});
    }
    if ((is_sample_ || start.problem) && !recording_)
        show_start_page();
}

Viewer::~Viewer() {
    workers_.set_wake({});
    ShownModelPointer model = std::exchange(shown_.model, nullptr);
    edits_.show_model(); // releases it, too
    destroy_in(workers_.background, std::move(model));
}

int Viewer::run() {
    if (Opening *const opening = opener_.opening())
        opening->hurry();
    while (!quit_) {
        update_theme();
        for (const Event &event : window_.wait(timeout()))
            std::visit([this](const auto &e) { handle(e); }, event);
        if (window_.close_requested())
            request_quit();
        if (quit_)
            break;
        navigator_.follow();
        if (const auto failed = receive_model())
            return *failed;
        receive_dialog();
        follow_file();
        if (shown_.model)
            report_damage(shown_.model->take_errors());
        pictures_.receive();
        edits_.serve();
        pictures_.draw(picture_size());
        if (recording_)
            record();
        notices_.serve();
        if (hint_until_ && hint_opacity() < 1) {
            window_.invalidate();
            if (hint_opacity() == 0)
                hint_until_.reset();
        }
        if (window_.is_stale())
            present();
        search_damage();
        ask_desktop();
    }
    if (recording_)
        std::cout << "stopped: " << recording_->video().output << " was not written" << std::endl;
    recording_.reset();
    pictures_.receive_saves(true);
    edits_.receive_save(true);
    if (notices_.verbose())
        std::cout << "frames: " << frame_log_.frames() << std::endl;
    return shown_.model ? exit_code_ : problem_code_;
}

// 1, and down to 0 while the hint fades.
double Viewer::hint_opacity() const {
    return hint_until_ ? std::clamp((*hint_until_ - Window::now()) / kFade, 0.0, 1.0) : 0;
}

// Seconds until something is due without further events; absent: nothing is due.
std::optional<double> Viewer::timeout() const {
    const double now = Window::now();
    std::optional<double> at;
    const auto no_later_than = [&](std::optional<double> time) {
        if (time)
            at = at ? std::min(*at, *time) : *time;
    };
    if (window_.is_stale() || shown_.is_recorded)
        no_later_than(now);
    no_later_than(notices_.until());
    no_later_than(edits_.due());
    if (hint_until_)
        no_later_than(hint_opacity() < 1 ? now + kFadeStep : *hint_until_ - kFade);
    if (workers_.background.busy() || workers_.baking.busy() || opener_.opening() || opener_.asks() ||
        (shown_.model && (damage_->is_searching() || shown_.model->streamed().is_loading())))
        no_later_than(now + kBusyPoll);
    no_later_than(navigator_.due(now));
    if (shown_.is_overwritten && !opener_.opening() && !edits_.is_saving())
        no_later_than(follower_->next_look());
    no_later_than(pictures_.due(picture_size()));
    return at ? std::optional(std::max(0.0, *at - now)) : std::nullopt;
}

// Starts the video once the picture has full detail, then draws one frame per call; the last call ends the program.
void Viewer::record() {
    if (!shown_.is_recorded) {
        if (!pictures_.is_exact())
            return;
        recording_->begin();
    }
    if (recording_->done())
        return end_recording(recording_->finish());
    const Camera camera = recording_->camera();
    const Status added = recording_->add([&](const Framebuffer &pixels, const PictureStatistics &drawn) {
        pictures_.show_frame(pixels, drawn);
        if (notices_.verbose())
            std::cout << "view: " << view_as_options(camera, shown_.options, shown_.options.resolution)
                      << look_as_options(look_of(Motion::moving, shown_.look->options)) << std::endl;
    });
    if (!added)
        end_recording(added);
}

void Viewer::end_recording(const Status &status) {
    const std::string output = recording_->video().output;
    recording_.reset();
    quit_ = true;
    if (!status && has_offset(status.error())) // of the model
        exit_code_ = notices_.fail(shown_.model->path(), with_advice(notices_.program(), status.error()));
    else if (!status)
        exit_code_ = notices_.fail(output, status.error());
    else if (output != "-")
        notices_.print("saved " + output);
}

} // namespace pbm
