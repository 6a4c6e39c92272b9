// Which file is opened, followed and shown, and what is wrong with it.
#include "viewer.h"

#include "viewer/pbm-view/window/desktop.h"
#include "viewer/pbm-view/window/view_text.h"

#include <utility>

namespace pbm {
namespace {

constexpr double kHintTime = 8; // seconds

} // namespace

// Takes the model if opening has ended. Returns the exit code if the program must end.
std::optional<int> Viewer::receive_model() {
    auto opened = opener_.take();
    if (!opened) {
        if (opener_.opening() && opener_.opening()->progress())
            window_.invalidate();
        return std::nullopt;
    }
    window_.invalidate();
    const std::string &path = opened->path;
    if (opened->model) {
        const bool is_kept = !std::exchange(is_sample_, false) && !recording_;
        if (const Status shown = show(std::move(*opened->model), opened->again); !shown)
            return command_line::fail_usage(notices_.program(), shown.error().message);
        if (is_kept)
            recent_.add(path);
        if (!opened->warning.empty())
            notices_.warn(opened->warning);
    } else if (opened->again && (opened->quietly || follower_->is_being_written())) {
        // The file is not whole yet.
    } else if (!opened->was_cancelled) {
        const int code = report_problem(path, opened->model.error());
        if (recording_)
            return code;
    } else if (opened->next.empty()) {
        notices_.notify("Cancelled: " + file_name(path));
        if (!shown_.model)
            show_start_page();
    }
    if (!opened->next.empty())
        open(opened->next);
    return std::nullopt;
}

// `again`: the file of the model shown was replaced.
Status Viewer::show(ShownModelPointer loaded, bool again) {
    if (shown_.model)
        forget_camera(shown_.options);
    const auto camera = navigator_.first_camera(*loaded, picture_size());
    if (!camera)
        return camera.error();
    ModelNotes notes = read_notes(loaded->streamed().reader().metadata());
    if (!shown_.options.view.empty()) {
        auto named = find_view(loaded->streamed().reader().metadata(), shown_.options.view);
        if (!named)
            return named.error();
        notes.view = *named;
    }
    const LookPointer look_before = shown_.look;
    ShownModelPointer model_before = std::exchange(shown_.model, std::move(loaded));
    const ShownModel &model = *shown_.model;
    const bool is_same = model_before && again && model_before->path() == model.path();
    shown_.is_overwritten = false;
    drag_.reset();
    damage_.emplace();
    shown_.look = model.first_look();
    edits_.show_model();
    destroy_in(workers_.background, std::move(model_before));
    if (!is_same)
        tools_.show_model();
    if (picture_size() != glm::ivec2(0))
        shown_.size = picture_size();
    navigator_.show_model(is_same ? std::nullopt : std::optional(*camera), notes.view);
    // Options that the user has changed survive the change of model.
    const bool recolours = std::exchange(recolours_, false) && is_same;
    if (recolours)
        shown_.look = look_before;
    else if (look_before)
        shown_.look = model.look_with(look_before->options, shown_.up());
    else if (!recording_ && is_first_start())
        hint_until_ = Window::now() + kHintTime;
    panel_.show_model({.file = &model.parameters(),
                       .colours = model.colours() ? &*model.colours() : nullptr,
                       .has_panorama = model.has_panorama(),
                       .points = model.streamed().reader().header().point_count,
                       .bounds = model.bounds(),
                       .title = file_name(model.path()),
                       .notes = std::move(notes)},
                      *model.first_look());
    pictures_.show_model();
    start_page_.set_problem(std::nullopt);
    update_windows(); // lays out the panel before it is drawn
    window_.set_title(file_name(model.path()) + opener_.files().position() + " - " + std::string(notices_.program()) +
                      " (F1: help)");
    if (recolours || (is_same && edits_.take_was_saved()))
        return {}; // that was told
    if (is_same)
        notices_.notify(file_name(model.path()) + " was written anew");
    else
        follower_.emplace(shown_, window_, workers_.helpers);
    return {};
}

// Opens the first of `paths`; the page keys go through the others.
void Viewer::open_files(const std::vector<std::string> &paths) {
    auto files = FileList::of(paths);
    if (!files) {
        report_problem("", files.error());
        return;
    }
    opener_.files() = std::move(*files);
    open(opener_.files().current());
}

// `again`: the file of the model shown was replaced, so the view stays. `quietly`: without a word if that fails.
void Viewer::open(const std::string &path, bool again, bool quietly) {
    if (!again && !losses().empty())
        return ask_about_losses("open " + file_name(path), [this, path] {
            edits_.discard();
            tools_.forget_points();
            open(path);
        });
    start_page_.hide();
    window_.invalidate();
    ViewOptions options = shown_.options;
    if (shown_.model)
        forget_camera(options);
    if (shown_.look && (options.look.colour_by = shown_.look->options.colour_by))
        options.look.colour_by->if_there = true;
    if (shown_.look) {
        options.look.classes = shown_.look->options.classes;
        options.look.classes.if_there = true;
    }
    if (shown_.size != glm::ivec2(0))
        options.resolution = shown_.size;
    opener_.open(path, options, again, quietly);
}

void Viewer::open_neighbour(int steps) {
    if (recording_)
        return;
    if (opener_.files().step(steps))
        open(opener_.files().current());
    else
        notices_.notify("There is no other model and no other scan in this folder");
}

void Viewer::open_dialog() {
    if (!recording_)
        opener_.ask();
}

void Viewer::receive_dialog() {
    const auto files = opener_.take_answer();
    if (!files)
        return;
    if (!*files) {
        notices_.fail("", files->error());
        const Explanation explanation = explain(files->error());
        notices_.notify(explanation.what + " " + explanation.advice, true);
    } else if (!(*files)->empty()) {
        open_files(**files);
    }
}

// An empty path: the open dialog.
void Viewer::choose_from_page(const std::optional<StartPage::Choice> &choice) {
    window_.invalidate();
    if (!choice)
        update_windows(); // its details were opened or closed
    else if (choice->path.empty())
        open_dialog();
    else
        open_files({choice->path});
}

void Viewer::show_start_page() {
    start_page_.show(recent_.list());
    point_overlay();
    update_windows();
    window_.invalidate();
}

// Opens the file of the model shown again if it was replaced or written.
void Viewer::follow_file() {
    if (!shown_.model || recording_)
        return;
    if (follower_->is_being_written())
        window_.invalidate();
    if (follower_->has_news() && !shown_.is_overwritten && shown_.model->is_overwritten())
        hold_picture();
    if (opener_.opening() || edits_.is_saving())
        return;
    const bool is_told = follower_->take_whole();
    if (!is_told && !follower_->has_settled())
        return;
    follower_->try_again();
    const std::string path = shown_.model->path();
    if (!edits_.is_unsaved())
        open(path, true, !is_told);
    else if (shown_.is_overwritten)
        ask_about_losses("open what was written to " + file_name(path), [this, path] { open(path, true); });
    else
        notices_.notify(file_name(path) + " was written anew; the window keeps its lights and materials", true);
}

// Keeps the last picture, and the camera that it shows: nothing can be drawn of a file that was written over.
void Viewer::hold_picture() {
    if (shown_.is_overwritten)
        return;
    shown_.is_overwritten = true;
    follower_->hold();
    navigator_.hold();
    drag_.reset();
    pictures_.hold();
    damage_->stop();
    window_.invalidate();
}

// Once the picture has full detail and is shown, looks for damage in what it does not show.
void Viewer::search_damage() {
    if (!shown_.model)
        return;
    report_damage(damage_->take_found());
    if (!recording_ && pictures_.is_exact() && !window_.is_stale())
        damage_->search(workers_.idle, shown_.model);
}

// Reports each fault once, whether a picture met it or the search. Coarser levels stay in place of damaged chunks.
void Viewer::report_damage(const std::vector<Error> &errors) {
    if (!errors.empty() && !recording_ && shown_.model->is_overwritten())
        return hold_picture();
    const Error *first = nullptr;
    for (const Error &error : errors) {
        if (!damage_->is_new(error))
            continue;
        notices_.fail(shown_.model->path(), with_advice(notices_.program(), error));
        first = first == nullptr ? &error : first;
    }
    if (first == nullptr)
        return;
    if (recording_) { // a video of a damaged model would be wrong
        recording_.reset();
        exit_code_ = exit_code(first->code);
        quit_ = true;
        return;
    }
    const std::string name = file_name(shown_.model->path());
    const Explanation explanation = explain(*first);
    start_page_.set_problem({{name, explanation}});
    notices_.notify(name + ": " + explanation.what + " What is damaged is drawn coarser. Ctrl+R: details", true);
}

// Says on standard error and in the window that `path` cannot be shown. Returns its exit code.
int Viewer::report_problem(const std::string &path, const Error &error) {
    const int code = notices_.fail(path, error);
    const Explanation explanation = explain(error);
    start_page_.set_problem({{file_name(path), explanation}});
    if (shown_.model) {
        notices_.notify((path.empty() ? "" : file_name(path) + ": ") + explanation.what + " Ctrl+R: details", true);
    } else {
        problem_code_ = code;
        if (!recording_)
            show_start_page();
    }
    return code;
}

} // namespace pbm
