// What the window shows and how it answers: models, cameras, pictures, cards of text.
//
// Coarse pictures are drawn between two events, on this thread; loading, fine pictures of large models and saving
// happen on the background thread, so that the window always answers. FrameScheduler says which picture is due.
#pragma once

#include "options.h"
#include "overlay.h"
#include "presenter.h"
#include "window.h"

#include "viewer/background_thread.h"
#include "viewer/frame_scheduler.h"
#include "viewer/scene.h"

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

struct LoadedScene {
    std::string path;
    std::shared_ptr<const Scene> scene;
    Sphere bounds;
};
using Loading = std::future<Result<LoadedScene>>;

Loading begin_loading(BackgroundThread &background, const std::string &path, const LoadOptions &options);

class Viewer {
  public:
    using Clock = std::chrono::steady_clock;

    // `loading` is that of `path`, begun before there was a window, by a program that started at `start`.
    Viewer(std::string_view program, const Arguments &arguments, Window &window, BackgroundThread &background,
           const std::string &path, Loading loading, Clock::time_point start);
    ~Viewer();
    Viewer(const Viewer &) = delete;
    Viewer &operator=(const Viewer &) = delete;

    // Until the user has had enough; returns the program's exit code.
    int run();

  private:
    // A fine picture, and the view it is of.
    struct Picture {
        std::uint64_t view;
        Framebuffer pixels;
        RenderStatistics drawn;
        double seconds;
    };
    struct Notice {
        std::string text;
        bool is_problem = false;
        double until = 0;
    };

    void handle(const KeyEvent &event);
    void handle(const ButtonEvent &event);
    void handle(const MoveEvent &event);
    void handle(const WheelEvent &event);
    void handle(const DropEvent &event);
    void handle(const RefreshEvent &event);

    std::optional<int> receive_model();
    void open(const std::string &path);
    Status show(LoadedScene loaded);
    void move_to(const Camera &camera);
    void change_view();
    Result<Camera> first_camera(const LoadedScene &model) const;
    void reset_camera();

    void draw_due_picture();
    void draw_now(int level);
    void draw_in_background(int level);
    void receive_picture();
    void show_picture(const Framebuffer &pixels, const RenderStatistics &drawn, double seconds);

    void save();
    void receive_saves(bool all);
    void notify(std::string text, bool is_problem);

    std::optional<double> timeout() const;
    glm::ivec2 picture_size() const;
    OverlayText overlay_text() const;
    void present();
    bool verbose() const { return options_.verbosity == command_line::Verbosity::verbose; }

    const std::string_view program_;
    ViewOptions options_;
    Window &window_;
    BackgroundThread &background_;
    Presenter presenter_;
    Overlay overlay_;
    const Clock::time_point start_;
    const double context_; // when the OpenGL context was there, window's clock

    Loading loading_;
    std::string loading_path_;
    std::string dropped_path_; // to be opened when what is being loaded is there; empty for none
    std::optional<LoadedScene> model_;
    Camera camera_;
    CameraMode mode_;
    HeldArrows arrows_;

    std::optional<glm::dvec2> mouse_;     // last seen, picture heights
    std::optional<MouseButton> dragging_; // the button that began it
    bool drag_with_shift_ = false;
    double last_click_ = -1;
    glm::dvec2 last_click_place_{0};

    std::optional<FrameScheduler> scheduler_; // while there is a model
    std::uint64_t view_ = 0;                  // counts changes of model, camera and size
    glm::ivec2 view_size_{0};
    std::optional<Framebuffer> canvas_; // of pictures drawn on this thread
    std::future<Picture> refining_;
    RenderStatistics drawn_; // of the picture shown
    double drawn_seconds_ = 0;

    std::vector<std::future<Result<std::string>>> saves_;
    Notice notice_;
    bool show_help_ = false, show_frame_time_;
    bool stale_ = true; // what the window shows
    bool quit_ = false;
    std::uint64_t frames_ = 0;  // shown
    bool first_picture_ = true; // is still to come
};

} // namespace pbm
