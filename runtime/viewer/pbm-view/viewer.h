// Connects the window's events with models, cameras, pictures and overlays.
//
// This thread draws pictures of what is loaded, between two events. Opening, slow pictures and saving run on the
// background thread; the model's threads decode. So the window always responds. FrameScheduler says which picture is
// due.
#pragma once

#include "options.h"
#include "recording.h"
#include "refinement.h"
#include "window/overlay.h"
#include "window/panel.h"
#include "window/presenter.h"
#include "window/window.h"

#include "system/threads/thread_pool.h"
#include "viewer/scene/frame_scheduler.h"
#include "viewer/scene/picture_saver.h"
#include "viewer/scene/shown_model.h"

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

class Viewer {
  public:
    using Clock = std::chrono::steady_clock;

    // What the program started before it opened the window.
    struct Start {
        std::string_view program;
        Clock::time_point time; // when the program started
        std::string path;
        Loading loading;                // of `path`
        std::optional<VideoSink> video; // if there is one, the viewer records it and then ends
    };
    Viewer(const Arguments &arguments, Window &window, ThreadPool &background, Start start);
    ~Viewer();
    Viewer(const Viewer &) = delete;
    Viewer &operator=(const Viewer &) = delete;

    // Runs until the user quits; returns the program's exit code.
    int run();

  private:
    // A picture drawn in the background, and its view.
    struct Picture {
        std::uint64_t view;
        double max_error;
        Framebuffer pixels;
        PictureStatistics drawn;
    };
    struct Notice {
        std::string text;
        bool is_problem = false;
        double until = 0;
    };

    void handle(const KeyEvent &event);
    void handle(const EditEvent &event);
    void handle(const CharacterEvent &event);
    void handle(const ButtonEvent &event);
    void handle(const MoveEvent &event);
    void handle(const WheelEvent &event);
    void handle(const DropEvent &event);
    void handle(const RefreshEvent &event);

    std::optional<int> receive_model();
    void open(const std::string &path);
    Status show(ShownModelPointer loaded);
    void receive_chunks();
    void move_to(const Camera &camera);
    void change_view();
    Result<Camera> first_camera(const ShownModel &model) const;
    void reset_camera();

    void toggle_panel();
    void update_panel();
    bool build_panel(Look &look);
    void change_look(Look look);

    void record();
    void end_recording(const Status &status);

    void draw_due_picture();
    void draw_now(const DetailView &view);
    void draw_in_background(const DetailView &view);
    void receive_picture();
    std::optional<double> refinement_due() const;
    void refine();
    void end_refinement();
    void show_picture(const Framebuffer &pixels, double max_error, const PictureStatistics &drawn);
    Detail choose(const DetailView &view);
    void check_room();

    void save();
    void serve_saver();
    void receive_saves(bool all);
    void notify(std::string text, bool is_problem);

    std::optional<double> timeout() const;
    glm::ivec2 picture_size() const;
    OverlayText overlay_text() const;
    void present();
    void report_frame();
    bool verbose() const { return options_.verbosity == command_line::Verbosity::verbose; }

    const std::string_view program_;
    ViewOptions options_;
    const double min_fps_;
    Window &window_;
    ThreadPool &background_;
    const Clock::time_point start_;
    const double context_; // when the OpenGL context was created, window's clock
    Presenter presenter_;
    Overlay overlay_;

    Loading loading_;
    std::string loading_path_;
    std::string dropped_path_; // opened when the present loading ends; empty for none
    ShownModelPointer model_;
    LookPointer look_; // while there is a model
    Camera camera_;
    CameraMode mode_;
    HeldArrows arrows_;

    std::optional<glm::dvec2> mouse_;     // last seen, in picture heights
    std::optional<MouseButton> dragging_; // the button that started the drag
    bool drag_with_shift_ = false;
    double last_click_ = -1;
    glm::dvec2 last_click_place_{0};

    std::optional<FrameScheduler> scheduler_; // while there is a model
    std::uint64_t view_ = 0;                  // counts changes of model, camera and size
    glm::ivec2 view_size_{0};
    std::optional<Framebuffer> canvas_; // of pictures drawn on this thread
    std::future<Picture> drawing_;
    std::unique_ptr<Refinement> refinement_; // of the current view
    int samples_ = 0;                        // of the picture shown, if it is fine
    PictureStatistics drawn_;                // of the picture shown
    std::uint64_t full_view_ = 0;            // the view for which memory ran out
    bool has_reported_memory_ = false;       // has reported that memory is too small

    std::optional<VideoSink> video_; // until its recording starts
    const VideoOptions video_options_;
    std::unique_ptr<Recording> recording_;

    PictureSaver saver_;
    Panel panel_;
    Notice notice_;
    bool show_help_ = false, show_frame_time_, show_panel_;
    bool stale_ = true; // the window must be presented anew
    bool quit_ = false;
    int exit_code_ = 0;
    std::uint64_t frames_ = 0;                         // shown
    bool first_picture_ = true, exact_picture_ = true; // not yet reported
};

} // namespace pbm
