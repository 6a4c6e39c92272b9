// Connects the window's events with the owners of what happens: of the files that are opened, the camera, the pictures,
// the edits of the scene, the tools, the panel.
//
// This thread draws pictures of what is loaded, between two events. Opening, slow pictures and saving run on the
// background thread; the model's threads decode. So the window always responds.
#pragma once

#include "navigator.h"
#include "options.h"
#include "scene_edits.h"
#include "tools.h"
#include "viewer/pbm-view/drawing/frame_log.h"
#include "viewer/pbm-view/drawing/recording.h"
#include "viewer/pbm-view/opening/damage.h"
#include "viewer/pbm-view/opening/file_follower.h"
#include "viewer/pbm-view/opening/file_opener.h"
#include "viewer/pbm-view/window/panel.h"
#include "viewer/pbm-view/window/start_page.h"

#include "viewer/opening/recent_files.h"

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

class Viewer {
  public:
    // Threads that outlive the viewer; each pool runs what must not wait for the others.
    struct Workers {
        ThreadPool helpers{4};    // open files, watch a file, wait for a dialog
        ThreadPool idle{2};       // at the lowest priority
        ThreadPool background{2}; // draws, saves, frees
        ThreadPool baking{2};     // bakes shadows, writes models

        bool busy() const { return helpers.busy() || idle.busy() || background.busy() || baking.busy(); }
        // `wake` is called when work of any pool is done.
        void set_wake(const std::function<void()> &wake) {
            for (ThreadPool *const pool : {&helpers, &idle, &background, &baking})
                pool->set_wake(wake);
        }
    };
    // What the program did before it opened the window.
    struct Start {
        std::string_view program{};
        FrameLog::Clock::time_point time{}; // when the program started
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
    template <class Input> void pass(const Input &event);
    void handle(const KeyEvent &event);
    void handle_view_key(const KeyEvent &event);
    void handle(const EditEvent &event);
    void handle(const CharacterEvent &event);
    void handle(const ButtonEvent &event);
    void handle(const MoveEvent &event);
    void handle(const WheelEvent &event);
    void handle(const DropEvent &event);
    void handle(const RefreshEvent &event);
    glm::dvec2 mouse_pixel() const;
    std::optional<MeasuredPoint> seen() const; // under the mouse
    bool end_drag();
    void escape();
    void request_quit();

    std::optional<int> receive_model();
    Status show(ShownModelPointer loaded, bool again);
    void open_files(const std::vector<std::string> &paths);
    void open(const std::string &path, bool again = false, bool quietly = false);
    void open_neighbour(int steps);
    void open_dialog();
    void receive_dialog();
    void choose_from_page(const std::optional<StartPage::Choice> &choice);
    void show_start_page();
    void follow_file();
    void hold_picture();
    void search_damage();
    void report_damage(const std::vector<Error> &errors);
    int report_problem(const std::string &path, const Error &error);
    void record();
    void end_recording(const Status &status);

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
    void settle(std::function<void()> Question::*way);
    std::string losses() const;
    void ask_about_losses(const std::string &what, std::function<void()> accept, bool quits = false);
    void ask_to_save();

    void ask_desktop();
    void update_theme();
    double hint_opacity() const;
    bool has_panel() const { return show_panel_ && shown_.look && !shown_.is_recorded; }
    bool has_windows() const { return has_panel() || start_page_.is_shown(); }
    void toggle_panel();
    void focus_panel(bool takes_keys);
    void point_overlay();
    void update_windows();
    void build_windows(std::optional<Look> &changed);
    void change_look(Look look);
    void next_colours();
    void next_shading();
    std::optional<double> timeout() const;
    glm::ivec2 picture_size() const;
    OverlayText overlay_text() const;
    std::string status_text() const;
    void present();

    Window &window_;
    Workers &workers_;
    FrameLog frame_log_;
    Shown shown_;
    Notices notices_;
    Pictures pictures_;
    Navigator navigator_;
    SceneEdits edits_;
    Tools tools_;
    FileOpener opener_;
    std::optional<FileFollower> follower_; // while there is a model
    std::optional<Damage> damage_;         // of it
    std::unique_ptr<Recording> recording_; // if the program makes a video
    const RecentFiles recent_;
    bool is_sample_;         // the file that is opened first
    bool recolours_ = false; // the file of the model shown is opened for the colours of another field

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
    bool raking_ = false; // L is held: dragging moves a light

    Overlay overlay_;
    Panel panel_;
    bool panel_has_keys_ = false; // arrows and Tab move through the panel
    StartPage start_page_;
    std::optional<StartPage::Choice> page_choice_; // made in the last frame of the page
    std::optional<Question> question_;
    std::future<bool> asks_desktop_;       // whether it prefers light
    std::optional<bool> desktop_is_light_; // absent before it has answered
    std::optional<double> hint_until_;     // the hint of the first start is shown; window's clock
    bool show_help_ = false, show_frame_time_, show_panel_;
    bool quit_ = false;
    int exit_code_ = 0;
    int problem_code_ = 0; // of the last file that could not be shown, while none was
};

} // namespace pbm
