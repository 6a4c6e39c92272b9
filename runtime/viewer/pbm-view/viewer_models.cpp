// Opens files, receives what is loaded of models, and reports what is wrong with them.
#include "viewer.h"

#include "window/desktop.h"
#include "window/view_text.h"

#include "command_line/command_line.h"
#include "system/processes/this_process.h"
#include "viewer/opening/explanation.h"
#include "viewer/opening/file_dialog.h"
#include "viewer/scene/damage_search.h"

#include <filesystem>
#include <utility>

namespace pbm {
namespace {

constexpr double kHintTime = 8; // seconds
constexpr double kLook = 1;     // seconds, from one look at a file that was written over to the next

} // namespace

// Takes the model if opening has ended. Returns the exit code if the program must end.
std::optional<int> Viewer::receive_model() {
    if (!opening_)
        return std::nullopt;
    if (!opening_->is_ready()) {
        stale_ = stale_ || opening_->progress().has_value();
        return std::nullopt;
    }
    auto loaded = opening_->take();
    const std::string path = opening_->path();
    const bool was_cancelled = opening_->was_cancelled();
    opening_.reset();
    stale_ = true;
    if (loaded) {
        const bool is_kept = !std::exchange(is_sample_, false) && !video_;
        if (const Status shown = show(std::move(*loaded)); !shown)
            return command_line::fail_usage(program_, shown.error().message);
        if (is_kept)
            recent_.add(path);
    } else if (opening_again_ && (opening_quietly_ || *news_ == FileChange::writing)) {
        // The file is not whole yet.
    } else if (!was_cancelled) {
        const int code = report_problem(path, loaded.error());
        if (video_)
            return code;
    } else if (next_path_.empty()) {
        notify("Cancelled: " + file_name(path), false);
        if (!model_)
            show_start_page();
    }
    if (const std::string next = std::exchange(next_path_, ""); !next.empty())
        open(next);
    return std::nullopt;
}

// Opens the first of `paths`; the page keys go through the others.
void Viewer::open_files(const std::vector<std::string> &paths) {
    auto files = FileList::of(paths);
    if (!files) {
        report_problem("", files.error());
        return;
    }
    files_ = std::move(*files);
    open(files_.current());
}

// `again`: the file of the model shown was replaced, so the view stays. One file is opened at a time.
void Viewer::open(const std::string &path, bool again) {
    if (!again && !losses().empty())
        return ask_about_losses("open " + file_name(path), [this, path] {
            kept_ = look_->appearance; // is lost
            line_.clear();
            open(path);
        });
    start_page_.hide();
    stale_ = true;
    if (opening_) {
        next_path_ = path;
        if (opening_->progress())
            opening_->cancel();
        return;
    }
    ViewOptions options = options_;
    if (model_)
        forget_camera(options);
    if (look_ && (options.look.colour_by = look_->options.colour_by))
        options.look.colour_by->if_there = true;
    if (view_size_ != glm::ivec2(0))
        options.resolution = view_size_;
    opening_again_ = again;
    opening_quietly_ = false;
    opening_ = std::make_unique<Opening>(workers_.helpers, path, options, scans_);
}

void Viewer::open_neighbour(int steps) {
    if (video_ || recording_)
        return;
    if (files_.step(steps))
        open(files_.current());
    else
        notify("There is no other model and no other scan in this folder", false);
}

void Viewer::open_dialog() {
    if (dialog_.valid() || video_ || recording_)
        return;
    std::error_code ignored;
    const std::filesystem::path here = files_.empty() ? "" : std::filesystem::path(files_.current()).parent_path();
    dialog_ = workers_.helpers.post([folder = std::filesystem::absolute(here.empty() ? "." : here, ignored).string(),
                                     stop = stop_.get_token()] { return ask_for_files(folder, stop); });
}

// An empty path: the open dialog.
void Viewer::choose_from_page(const std::optional<StartPage::Choice> &choice) {
    stale_ = true;
    if (!choice)
        update_panel(); // its details were opened or closed
    else if (choice->path.empty())
        open_dialog();
    else
        open_files({choice->path});
}

void Viewer::receive_dialog() {
    if (!pbm::is_ready(dialog_))
        return;
    const auto files = dialog_.get();
    if (!files) {
        command_line::fail(program_, "", files.error());
        notify(explain(files.error()).what + " " + explain(files.error()).advice, true);
    } else if (!files->empty()) {
        open_files(*files);
    }
}

// Opens the file of the model shown again if it was replaced or written.
void Viewer::follow_file() {
    if (!model_ || video_ || recording_)
        return;
    const FileChange news = *news_;
    stale_ = stale_ || news == FileChange::writing;
    if (news != FileChange::none && !overwritten_ && model_->is_overwritten())
        hold_picture();
    if (opening_ || scene_save_.valid())
        return;
    FileChange whole = FileChange::whole;
    const bool is_told = news_->compare_exchange_strong(whole, FileChange::none);
    if (is_told || has_settled())
        reopen(!is_told);
}

// Whether a file that was written over, of which nobody tells when it is whole, has stopped to change: such news come
// from this machine alone.
bool Viewer::has_settled() {
    if (!overwritten_ || Window::now() < overwritten_->next_look)
        return false;
    const FileStamp stamp = model_->stamp();
    overwritten_->grows = stamp != std::exchange(overwritten_->seen, stamp);
    overwritten_->next_look = Window::now() + kLook;
    stale_ = true;
    return !overwritten_->grows && *news_ == FileChange::none && stamp != overwritten_->tried;
}

// `quietly`: without a word if that fails.
void Viewer::reopen(bool quietly) {
    if (overwritten_)
        overwritten_->tried = model_->stamp();
    const auto open_again = [this, path = model_->path()] { open(path, true); };
    if (!has_edits()) {
        open_again();
        opening_quietly_ = quietly;
    } else if (overwritten_) {
        ask_about_losses("open what was written to " + file_name(model_->path()), open_again);
    } else {
        notify(file_name(model_->path()) + " was written anew; the window keeps its lights and materials", true);
    }
}

// Keeps the last picture, and the camera that it shows: nothing can be drawn of a file that was written over.
void Viewer::hold_picture() {
    if (overwritten_)
        return;
    overwritten_ = {model_->stamp(), {}, true, Window::now() + kLook};
    glide_.reset();
    drag_.reset();
    if (is_usable(canvas_camera_))
        camera_ = canvas_camera_;
    ++view_; // what is drawn in the background is not shown
    end_refinement();
    stop_search_.request_stop();
    search_ = {};
    stale_ = true;
}

// What is told of the file of the model shown while it is not whole.
std::string Viewer::file_status() const {
    if (!model_ || (!overwritten_ && *news_ != FileChange::writing))
        return "";
    const bool is_written = *news_ == FileChange::writing || overwritten_->grows;
    return file_name(model_->path()) + (is_written ? " is being written; this picture is the last one"
                                                   : " was written over; this picture is the last one");
}

Status Viewer::show(ShownModelPointer loaded) {
    if (model_)
        forget_camera(options_);
    const auto camera = first_camera(*loaded);
    if (!camera)
        return camera.error();
    const LookPointer shown_look = look_;
    std::optional<LookOptions> shown_options;
    if (look_)
        shown_options = look_->options;
    const bool is_same = model_ && opening_again_ && model_->path() == loaded->path();
    overwritten_.reset();
    drag_.reset();
    stop_search_.request_stop();
    search_ = {};
    shadows_.show(loaded);
    destroy_in(background_, std::exchange(model_, std::move(loaded)));
    look_ = model_->first_look();
    kept_ = look_->appearance;
    const ByteView header = slice(model_->bytes(), 0, kHeaderBytes);
    header_.assign(header.begin(), header.end());
    glide_.reset();
    canvas_.reset();
    canvas_camera_ = {};
    if (is_same) {
        options_.clip = camera_.clip;
    } else {
        camera_ = *camera;
        axis_ = camera_.up;
        line_.clear();
        show_clip_handles_ = false;
    }
    if (picture_size() != glm::ivec2(0))
        view_size_ = picture_size();
    // Options that the user has changed survive the change of model.
    const bool recolours = std::exchange(recolours_, false) && is_same;
    if (recolours)
        look_ = shown_look;
    else if (shown_options)
        look_ = std::make_shared<Look>(*shown_options, model_->parameters(), up_of(options_, model_->grid()));
    if (!shown_options && !video_ && is_first_start())
        hint_until_ = Window::now() + kHintTime;
    ModelNotes notes = read_notes(model_->streamed().reader().metadata());
    options_.view_angle = view_angle_;
    if (notes.view && !options_.position && !options_.focal_point && !options_.view_up) {
        if (!is_same) {
            camera_ = notes.view->camera;
            axis_ = camera_.up;
        }
        options_.view_angle = notes.view->view_angle;
        options_.orthographic = camera_.orthographic;
    }
    panel_.show_model({.file = &model_->parameters(),
                       .has_panorama = model_->has_panorama(),
                       .points = model_->streamed().reader().header().point_count,
                       .bounds = model_->bounds(),
                       .title = file_name(model_->path()),
                       .notes = std::move(notes)},
                      *model_->first_look());
    ++view_;
    end_refinement();
    scheduler_.emplace(errors(), min_fps_);
    has_reported_memory_ = is_searched_ = false;
    damage_.clear();
    start_page_.set_problem(std::nullopt);
    update_panel(); // lays out the panel before it is drawn
    window_.set_title(file_name(model_->path()) + files_.position() + " - " + std::string(program_) + " (F1: help)");
    if (recolours || (is_same && std::exchange(was_saved_, false)))
        return {}; // that was told
    if (is_same)
        notify(file_name(model_->path()) + " was written anew", false);
    else
        watch();
    return {};
}

// Watches the file of the model shown.
void Viewer::watch() {
    if (watch_)
        watch_->stop();
    watch_ = std::make_shared<FileWatch>(model_->path());
    news_ = std::make_shared<News>(FileChange::none);
    workers_.helpers.post([watch = watch_, news = news_, &helpers = workers_.helpers] {
        for (FileChange change = watch->wait(); change != FileChange::none; change = watch->wait())
            if (news->exchange(change) != change)
                helpers.wake();
    });
}

// Once the picture has full detail, looks for damage in what it does not show.
void Viewer::search_damage() {
    if (pbm::is_ready(search_))
        report_damage(search_.get());
    if (is_searched_ || video_ || recording_ || !scheduler_ || !scheduler_->complete() ||
        model_->bytes().size() > kMaxSearchedBytes)
        return;
    is_searched_ = true;
    stop_search_ = {};
    search_ = workers_.idle.post([model = model_, stop = stop_search_.get_token()] {
        lower_priority();
        return find_damage(model->bytes(), stop);
    });
}

// Newly loaded chunks improve the picture. Damaged ones are reported; coarser levels stay in their place.
void Viewer::receive_chunks() {
    if (!model_)
        return;
    if (model_->take_arrivals())
        scheduler_->arrived(!model_->streamed().is_loading());
    report_damage(model_->take_errors());
}

// Reports each fault once, whether a picture met it or the search.
void Viewer::report_damage(const std::vector<Error> &errors) {
    if (!errors.empty() && !video_ && !recording_ && model_->is_overwritten())
        return hold_picture();
    const Error *first = nullptr;
    for (const Error &error : errors) {
        if (has_offset(error) && !damage_.insert(error.offset).second)
            continue;
        command_line::fail(program_, model_->path(), with_advice(program_, error));
        first = first == nullptr ? &error : first;
    }
    if (first == nullptr)
        return;
    if (video_ || recording_) { // a video of a damaged model would be wrong
        video_.reset();
        recording_.reset();
        exit_code_ = exit_code(first->code);
        quit_ = true;
        return;
    }
    const Explanation explanation = explain(*first);
    start_page_.set_problem({{file_name(model_->path()), explanation}});
    notify(file_name(model_->path()) + ": " + explanation.what + " What is damaged is drawn coarser. Ctrl+R: details",
           true);
}

// Says on standard error and in the window that `path` cannot be shown. Returns its exit code.
int Viewer::report_problem(const std::string &path, const Error &error) {
    const int code = command_line::fail(program_, path, error);
    const Explanation explanation = explain(error);
    start_page_.set_problem({{file_name(path), explanation}});
    if (model_) {
        notify((path.empty() ? "" : file_name(path) + ": ") + explanation.what + " Ctrl+R: details", true);
    } else {
        problem_code_ = code;
        if (!video_)
            show_start_page();
    }
    return code;
}

void Viewer::show_start_page() {
    start_page_.show(recent_.list());
    if (mouse_)
        overlay_.point(*mouse_ * static_cast<double>(window_.framebuffer_size().y));
    update_panel();
    stale_ = true;
}

} // namespace pbm
