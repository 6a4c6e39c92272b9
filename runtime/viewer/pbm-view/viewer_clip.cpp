// Cuts the model open by a plane or a box, whose handles are dragged.
#include "viewer.h"

namespace pbm {
namespace {

constexpr double kHandleReach = 12; // pixels at scale 1

} // namespace

// No clip region, a plane, a box, none again. A region of the command line gets its handles first.
void Viewer::switch_clip() {
    if (!model_ || recording_)
        return;
    ClipRegion clip = options_.clip;
    if (clip.empty()) {
        clip.plane = first_clip_plane(camera_, model_->bounds());
        notify("Clip plane: drag its dots to move and to turn it. K: a box, Escape: the whole model", false);
    } else if (!show_clip_handles_) {
        notify("Drag the dots. K: the next kind of clip region", false);
    } else if (clip.plane) {
        clip = {.plane = {}, .box = first_clip_box(model_->bounds())};
        notify("Clip box: drag the dots of its faces. K: the whole model", false);
    } else {
        clip = {};
    }
    show_clip_handles_ = !clip.empty();
    set_clip(clip);
}

void Viewer::set_clip(const ClipRegion &clip) {
    options_.clip = clip;
    Camera camera = camera_;
    camera.clip = clip;
    move_to(camera);
}

// Takes the mouse if it is at a handle.
bool Viewer::begin_clip_drag() {
    if (!show_clip_handles_ || !model_ || recording_)
        return false;
    drag_->handle = handle_at(clip_handles(options_.clip, model_->bounds().radius), space_of(camera_), mouse_pixel(),
                              kHandleReach * window_.content_scale());
    return drag_->handle.has_value();
}

void Viewer::drag_clip() {
    set_clip(
        after_handle_drag(options_.clip, *drag_->handle, model_->bounds().radius, space_of(camera_), mouse_pixel()));
}

void Viewer::add_clip_handles(OverlayDrawing &to) const {
    const double radius = model_->bounds().radius;
    const PictureSpace space = space_of(camera_);
    for (const auto &[from, end] : clip_outline(options_.clip, radius))
        if (const auto line = space.image(from, end))
            to.lines.push_back({line->from, line->to});
    for (const HandlePlace &handle : clip_handles(options_.clip, radius))
        if (const PictureSpace::Place place = space.place(handle.place); place.depth > 0)
            to.marks.push_back(place.pixel);
}

} // namespace pbm
