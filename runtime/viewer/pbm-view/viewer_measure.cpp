// Measures on the surface that the picture shows: points, distances, the scale bar, coordinates under the mouse.
#include "viewer.h"

#include "viewer/measure/scale_bar.h"

#include <glm/common.hpp>

#include <iostream>

namespace pbm {
namespace {

constexpr double kScaleBarShare = 0.2; // of the picture's width, at most

} // namespace

PictureSpace Viewer::space_of(const Camera &camera) const { return {camera, model_->grid().edge(), view_size_}; }

// Pixels from the upper left corner of the picture; its middle as long as the mouse has not moved in the window.
glm::dvec2 Viewer::mouse_pixel() const {
    return mouse_ ? *mouse_ * static_cast<double>(window_.framebuffer_size().y) : glm::dvec2(view_size_) / 2.0;
}

std::optional<PickedPoint> Viewer::pick_under_mouse() const {
    if (!model_ || !mouse_ || !canvas_ || glm::ivec2(canvas_->width, canvas_->height) != view_size_)
        return std::nullopt;
    return pick(*canvas_, space_of(canvas_camera_), glm::ivec2(glm::floor(mouse_pixel())));
}

MeasuredPoint Viewer::measured(const PickedPoint &point) const {
    const Grid &grid = model_->grid();
    const double pixel_size = space_of(canvas_camera_).pixel_size(point.depth);
    return {point.place, point_uncertainty(grid.voxel_size_at(drawn_.drawn.level),
                                           grid.voxel_size_at(drawn_.coarsest_level), drawn_.error, pixel_size)};
}

void Viewer::toggle_measuring() {
    if (!model_)
        return;
    measuring_ = !measuring_;
    if (measuring_)
        notify("Click on two points or more; Backspace takes the last one back, Delete all, Ctrl + C copies", false);
    else if (!line_.points().empty())
        notify("M shows the measured points again", false);
}

void Viewer::add_point() {
    const auto point = pick_under_mouse();
    if (!point)
        return notify("There is no surface under the mouse", false);
    const std::span<const MeasuredPoint> points = line_.points();
    if (!points.empty() && points.back().place == point->place)
        return; // the second click of a double click
    line_.add(measured(*point));
    stale_ = true;
    if (options_.verbosity == command_line::Verbosity::quiet)
        return;
    const Unit unit = model_->grid().unit;
    const std::size_t count = line_.points().size();
    std::cout << "point " << count << ": " << point_text(line_.points().back(), unit) << '\n';
    if (count > 1)
        std::cout << "distance " << count - 1 << " to " << count << ": " << length_text(line_.segment(count - 2), unit)
                  << '\n';
    if (count > 2)
        std::cout << "along all: " << length_text(line_.total(), unit) << '\n';
    std::cout << std::flush;
}

void Viewer::copy_measurement() {
    if (!is_measuring() || line_.points().empty())
        return;
    window_.copy(polyline_text(line_, model_->grid().unit));
    notify("Copied the points and distances", false);
}

OverlayDrawing Viewer::measure_drawing() const {
    OverlayDrawing drawing;
    if (view_size_ == glm::ivec2(0))
        return drawing;
    const Unit unit = model_->grid().unit;
    const PictureSpace space = space_of(camera_);
    if (show_coordinates_) {
        const auto point = pick_under_mouse();
        drawing.reading = point ? point_text(measured(*point), unit) : "no surface under the mouse";
    }
    if (!measuring_)
        return drawing;
    const ScaleBar bar = scale_bar(space.pixel_size(space.focal_depth()), kScaleBarShare * view_size_.x, unit);
    drawing.bar = {bar.pixels, bar.text + (camera_.orthographic ? "" : ", in the plane of the focal point")};
    const std::span<const MeasuredPoint> points = line_.points();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const PictureSpace::Place place = space.place(points[i].place);
        if (place.depth > 0)
            drawing.marks.push_back(place.pixel);
        if (i == 0)
            continue;
        const auto line = space.image(points[i - 1].place, points[i].place);
        if (!line)
            continue;
        drawing.lines.push_back({line->from, line->to});
        drawing.labels.push_back({(line->from + line->to) / 2.0, length_text(line_.segment(i - 1), unit)});
    }
    if (points.size() > 2 && !drawing.marks.empty())
        drawing.labels.push_back({drawing.marks.back(), "along all: " + length_text(line_.total(), unit)});
    return drawing;
}

} // namespace pbm
