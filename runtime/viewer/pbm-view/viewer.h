// Connects the window's events with models, cameras, pictures and overlays.
//
// This thread draws pictures of what is loaded, between two events. Opening, slow pictures and saving run on the
// background thread; the model's threads decode. So the window always responds. FrameScheduler says which picture is
// due.
#pragma once

#include "opening.h"
#include "options.h"
#include "recording.h"
#include "refinement.h"
#include "window/overlay.h"
#include "window/panel.h"
#include "window/presenter.h"
#include "window/start_page.h"
#include "window/window.h"

#include "system/files/file_watch.h"
#include "system/threads/thread_pool.h"
#include "viewer/clipping/clip_handles.h"
#include "viewer/light/moved_shadows.h"
#include "viewer/measure/picture_space.h"
#include "viewer/measure/polyline.h"
#include "viewer/navigation/camera_glide.h"
#include "viewer/navigation/saved_views.h"
#include "viewer/navigation/standard_views.h"
#include "viewer/opening/file_list.h"
#include "viewer/opening/recent_files.h"
#include "viewer/scene/frame_scheduler.h"
#include "viewer/scene/picture_saver.h"
#include "viewer/scene/shown_model.h"

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

namespace pbm {

class Viewer {
  public:
    using Clock = std::chrono::steady_clock;

    // Threads that outlive the viewer; each pool runs what must not wait for the others.
    struct Workers {
        ThreadPool helpers{4};    // open files, watch a file, wait for a dialog
        ThreadPool idle{2};       // at the lowest priority
        ThreadPool background{2}; // draws, saves, frees
        ThreadPool baking{2};     // bakes shadows, writes models

        bool busy() const { return helpers.busy() || idle.busy() || background.busy() || baking.busy(); }
    };
    // What the program did before it opened the window.
    struct Start {
        std::string_view program{};
        Clock::time_point time{};           // when the program started
        FileList files{};                   // the current one is `opening`; empty without a model
        bool is_sample = false;             // no file was named
        std::unique_ptr<Opening> opening{}; // null if its file is known to be bad
        std::optional<Error> problem{};     // of that file, already told on standard error
        std::optional<VideoSink> video{};   // if there is one, the viewer records it and then ends
    };
    Viewer(const Arguments &arguments, Window &window, Workers &workers, Start start);
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
    void handle_view_key(Key key);
    void handle(const EditEvent &event);
    void handle(const CharacterEvent &event);
    void handle(const ButtonEvent &event);
    void handle(const MoveEvent &event);
    void handle(const WheelEvent &event);
    void handle(const DropEvent &event);
    void handle(const RefreshEvent &event);

    std::optional<int> receive_model();
    void open_files(const std::vector<std::string> &paths);
    void open(const std::string &path, bool again = false);
    void open_neighbour(int steps);
    void open_dialog();
    void choose_from_page(const std::optional<StartPage::Choice> &choice);
    void receive_dialog();
    void follow_file();
    bool has_settled();
    void reopen(bool quietly);
    void hold_picture();
    std::string file_status() const;
    Status show(ShownModelPointer loaded);
    void watch();
    void search_damage();
    void receive_chunks();
    void report_damage(const std::vector<Error> &errors);
    int report_problem(const std::string &path, const Error &error);
    void show_start_page();
    void move_to(const Camera &camera);
    void set_camera(const Camera &camera);
    void change_view();
    Result<Camera> first_camera(const ShownModel &model) const;
    void reset_camera();
    void turn_up_axis();
    Steering steering() const { return {mode_, axis_, model_->bounds()}; }
    void glide_to(const Camera &camera);
    void follow_glide();
    void look_from(StandardView view);
    void fit();
    void toggle_projection();
    void switch_backs();
    void save_view(int number);
    void recall_view(int number);
    void focus();
    void zoom(double notches);

    bool is_measuring() const { return measuring_ && model_; }
    PictureSpace space_of(const Camera &camera) const;
    glm::dvec2 mouse_pixel() const;
    std::optional<PickedPoint> pick_under_mouse() const;
    MeasuredPoint measured(const PickedPoint &point) const;
    void switch_clip();
    void set_clip(const ClipRegion &clip);
    bool begin_clip_drag();
    void drag_clip();
    void add_clip_handles(OverlayDrawing &to) const;
    void toggle_measuring();
    void add_point();
    void copy_measurement();
    OverlayDrawing measure_drawing() const;

    void update_theme();
    double hint_opacity() const;
    bool has_panel() const { return show_panel_ && look_ && !recording_; }
    void toggle_panel();
    bool has_windows() const { return has_panel() || start_page_.is_shown(); }
    void focus_panel(bool takes_keys);
    void update_panel();
    void build_windows(std::optional<Look> &changed);
    void change_look(Look look);
    void rake();
    void serve_shadows();
    std::string shadow_note() const;

    // Asks before something is replaced or lost. Enter accepts, the letter chooses the other way, Escape goes back.
    struct Question {
        std::string text;
        std::function<void()> accept;
        char letter = 0;
        std::function<void()> other{};
        bool quits = false; // whether accepting ends the program
    };
    void ask(Question question);
    bool answer(const KeyEvent &event);
    std::string losses() const;
    void ask_about_losses(const std::string &what, std::function<void()> accept, bool quits = false);
    void escape();
    bool end_drag();
    bool leave_tool();
    void request_quit();
    Look look_to_keep() const;
    bool has_edits() const;
    void copy_options();
    void ask_to_save();
    void begin_scene_save();
    void receive_scene_save(bool wait);
    void save_recipe();

    void record();
    void end_recording(const Status &status);

    void draw_due_picture();
    void draw_now(const DetailView &view);
    void draw_in_background(const DetailView &view);
    void receive_picture();
    std::optional<double> refinement_due() const;
    void refine();
    void end_refinement();
    void show_picture(double max_error, const PictureStatistics &drawn);
    DetailView still_view() const;
    FrameScheduler::Errors errors() const; // of pictures with the present look
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
    const double view_angle_; // of the command line, degrees
    const double min_fps_;
    Window &window_;
    Workers &workers_;
    ThreadPool &background_;
    const Clock::time_point start_;
    const double context_; // when the OpenGL context was created, window's clock
    Presenter presenter_;
    Overlay overlay_;

    const ScanOptions scans_;
    FileList files_;
    const RecentFiles recent_;
    bool is_sample_; // the file that is opened first
    std::unique_ptr<Opening> opening_;
    std::string next_path_;      // opened when `opening_` ends; empty for none
    bool opening_again_ = false; // `opening_` is of the model shown, whose file was replaced
    bool recolours_ = false;     // or whose points get the colours of another field
    std::future<Result<std::vector<std::string>>> dialog_;
    StartPage start_page_;
    std::optional<StartPage::Choice> page_choice_; // made in the last frame of the page
    int problem_code_ = 0;                         // of the last file that could not be shown, while none was
    std::stop_source stop_;                        // ends the dialog
    std::shared_ptr<FileWatch> watch_;             // of the model shown
    using News = std::atomic<FileChange>;
    std::shared_ptr<News> news_ = std::make_shared<News>(FileChange::none); // of its file
    // Its file was written in place: its last picture stays until the file can be opened.
    struct Overwritten {
        FileStamp seen, tried; // when it was looked at, and opened, last
        bool grows;            // changed between the last two looks
        double next_look;      // window's clock
    };
    std::optional<Overwritten> overwritten_;
    bool opening_quietly_ = false; // nobody said that the file is whole
    std::stop_source stop_search_;
    std::future<std::vector<Error>> search_; // of damage in the model shown
    bool is_searched_ = false;
    std::set<std::uint64_t> damage_; // offsets that were reported
    ShownModelPointer model_;
    LookPointer look_; // while there is a model
    Camera camera_;
    glm::dvec3 axis_{0, 1, 0}; // that the camera turns about
    CameraMode mode_;
    HeldArrows arrows_;
    std::optional<CameraGlide> glide_; // sets `camera_` until its end
    struct ZoomAnchor {
        glm::dvec2 mouse; // pixels
        Camera camera;    // after the last zoom
        glm::dvec3 point;
    };
    const SavedViews saved_views_;
    std::optional<ZoomAnchor> anchor_; // holds while the mouse and the camera stay

    std::optional<glm::dvec2> mouse_; // last seen, in picture heights
    struct HeldButton {
        MouseButton button; // that started the drag
        bool with_shift;
        glm::dvec2 place; // where it started
        bool is_click;    // so far the drag has not moved
        Camera camera;    // before it
        LookPointer look;
        std::optional<ClipHandle> handle{}; // is dragged instead of the camera
    };
    std::optional<HeldButton> drag_;
    double last_click_ = -1;
    glm::dvec2 last_click_place_{0};

    bool show_clip_handles_ = false;
    bool measuring_ = false, show_coordinates_ = false;
    Polyline line_; // measured

    std::optional<FrameScheduler> scheduler_; // while there is a model
    std::uint64_t view_ = 0;                  // counts changes of model, camera and size
    glm::ivec2 view_size_{0};
    std::optional<Framebuffer> canvas_; // the picture shown; of the present model
    Camera canvas_camera_;              // that it shows
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
    bool panel_has_keys_ = false; // arrows and Tab move through the panel
    MovedShadows shadows_;
    bool raking_ = false; // L is held: dragging moves a light
    std::optional<Question> question_;
    std::optional<Appearance> kept_; // of the file, or as it was saved last
    Bytes header_;                   // of the file when it was opened or saved last
    std::future<Result<Bytes>> scene_save_;
    bool was_saved_ = false;                // by this window, and not opened again since
    bool saves_after_baking_ = false;       // what is to be saved lacks shadows that are baked
    std::optional<Appearance> scene_saved_; // what `scene_save_` writes
    Notice notice_;
    std::future<bool> asks_desktop_; // whether it prefers light
    bool desktop_is_light_ = false;
    std::optional<double> hint_until_; // the hint of the first start is shown; window's clock
    bool show_help_ = false, show_frame_time_, show_panel_;
    bool stale_ = true; // the window must be presented anew
    bool quit_ = false;
    int exit_code_ = 0;
    std::uint64_t frames_ = 0;                         // shown
    bool first_picture_ = true, exact_picture_ = true; // not yet reported
};

} // namespace pbm
