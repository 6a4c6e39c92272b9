#include "tools.h"

#include "viewer/finish/scale_bar.h"

#include <span>

namespace pbm {
namespace {

constexpr double kScaleBarShare = 0.2; // of the picture's width, at most
constexpr double kHandleReach = 12;    // pixels at scale 1

} // namespace

void Tools::show_model() {
    line_.clear();
    show_clip_handles_ = false;
}

bool Tools::leave() {
    if (show_clip_handles_) {
        show_clip_handles_ = false;
        navigator_.set_clip({});
    } else if (is_measuring()) {
        toggle_measuring();
    } else if (show_coordinates_) {
        show_coordinates_ = false;
    } else {
        return false;
    }
    return true;
}

OverlayDrawing Tools::drawing(const std::optional<MeasuredPoint> &seen) const {
    OverlayDrawing drawing;
    if (shown_.is_recorded)
        return drawing;
    if (show_coordinates_ && shown_.has_picture())
        drawing.reading = seen ? point_text(*seen, shown_.model->grid().unit) : "no surface under the mouse";
    if (measuring_ && shown_.has_picture())
        add_measures(drawing);
    if (show_clip_handles_)
        add_clip_handles(drawing);
    return drawing;
}

void Tools::toggle_measuring() {
    if (!shown_.model)
        return;
    measuring_ = !measuring_;
    if (measuring_)
        notices_.notify("Click on two points or more; Backspace takes the last one back, Delete all, Ctrl + C copies");
    else if (!line_.points().empty())
        notices_.notify("M shows the measured points again");
}

void Tools::add_point(const std::optional<MeasuredPoint> &seen) {
    if (!seen)
        return notices_.notify("There is no surface under the mouse");
    const std::span<const MeasuredPoint> points = line_.points();
    if (!points.empty() && points.back().place == seen->place)
        return; // the second click of a double click
    line_.add(*seen);
    window_.invalidate();
    const Unit unit = shown_.model->grid().unit;
    const std::size_t count = line_.points().size();
    notices_.print("point " + std::to_string(count) + ": " + point_text(*seen, unit));
    if (count > 1)
        notices_.print("distance " + std::to_string(count - 1) + " to " + std::to_string(count) + ": " +
                       length_text(line_.segment(count - 2), unit));
    if (count > 2)
        notices_.print("along all: " + length_text(line_.total(), unit));
}

void Tools::edit(EditKey key) {
    if (key == EditKey::backspace)
        line_.remove_last();
    else if (key == EditKey::erase)
        line_.clear();
    window_.invalidate();
}

void Tools::copy() const {
    if (line_.points().empty())
        return;
    window_.copy(polyline_text(line_, shown_.model->grid().unit));
    notices_.notify("Copied the points and distances");
}

std::string Tools::losses() const {
    const std::size_t points = line_.points().size();
    if (points == 0)
        return "";
    return std::to_string(points) + (points == 1 ? " measured point" : " measured points") + " would be lost.\n";
}

void Tools::add_measures(OverlayDrawing &to) const {
    const Unit unit = shown_.model->grid().unit;
    const PictureSpace space = shown_.space();
    const ScaleBar bar = scale_bar(space.pixel_size(space.focal_depth()), kScaleBarShare * shown_.size.x, unit);
    to.bar = {bar.pixels, bar.text + (shown_.camera.orthographic ? "" : ", in the plane of the focal point")};
    const std::span<const MeasuredPoint> points = line_.points();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const PictureSpace::Place place = space.place(points[i].place);
        if (place.depth > 0)
            to.marks.push_back(place.pixel);
        if (i == 0)
            continue;
        const auto line = space.image(points[i - 1].place, points[i].place);
        if (!line)
            continue;
        to.lines.push_back({line->from, line->to});
        to.labels.push_back({(line->from + line->to) / 2.0, length_text(line_.segment(i - 1), unit)});
    }
    if (points.size() > 2 && !to.marks.empty())
        to.labels.push_back({to.marks.back(), "along all: " + length_text(line_.total(), unit)});
}

void Tools::switch_clip() {
    if (!shown_.model || shown_.is_recorded)
        return;
    ClipRegion clip = shown_.options.clip;
    if (clip.empty()) {
        clip.plane = first_clip_plane(shown_.camera, shown_.model->bounds());
        notices_.notify("Clip plane: drag its dots to move and to turn it. K: a box, Escape: the whole model");
    } else if (!show_clip_handles_) {
        notices_.notify("Drag the dots. K: the next kind of clip region");
    } else if (clip.plane) {
        clip = {.plane = {}, .box = first_clip_box(shown_.model->bounds())};
        notices_.notify("Clip box: drag the dots of its faces. K: the whole model");
    } else {
        clip = {};
    }
    show_clip_handles_ = !clip.empty();
    navigator_.set_clip(clip);
}

std::optional<ClipHandle> Tools::handle_at(glm::dvec2 pixel) const {
    if (!show_clip_handles_ || !shown_.model || shown_.is_recorded)
        return std::nullopt;
    return pbm::handle_at(clip_handles(shown_.options.clip, shown_.model->bounds().radius), shown_.space(), pixel,
                          kHandleReach * window_.content_scale());
}

void Tools::drag_clip(ClipHandle handle, glm::dvec2 pixel) {
    navigator_.set_clip(
        after_handle_drag(shown_.options.clip, handle, shown_.model->bounds().radius, shown_.space(), pixel));
}

void Tools::add_clip_handles(OverlayDrawing &to) const {
    const double radius = shown_.model->bounds().radius;
    const PictureSpace space = shown_.space();
    for (const auto &[from, end] : clip_outline(shown_.options.clip, radius))
        if (const auto line = space.image(from, end))
            to.lines.push_back({line->from, line->to});
    for (const HandlePlace &handle : clip_handles(shown_.options.clip, radius))
        if (const PictureSpace::Place place = space.place(handle.place); place.depth > 0)
            to.marks.push_back(place.pixel);
}

} // namespace pbm
