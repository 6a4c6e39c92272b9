// Tools that a key begins and Escape ends: measuring, coordinates under the mouse, handles of the clip region. Pixels
// are those of the picture.
#pragma once

#include "navigator.h"

#include "viewer/pbm-view/clipping/clip_handles.h"
#include "viewer/pbm-view/window/overlay.h"

#include <optional>
#include <string>

namespace pbm {

class Tools {
  public:
    // All outlive it.
    Tools(const Shown &shown, Navigator &navigator, Notices &notices, Window &window)
        : shown_(shown), navigator_(navigator), notices_(notices), window_(window) {}

    // Another model is shown.
    void show_model();
    // Ends the tool begun last, in this order: clipping, measuring, coordinates. Returns whether there was one.
    bool leave();
    // What is drawn of the tools over the picture; `seen`: what is under the mouse. Needs a model.
    OverlayDrawing drawing(const std::optional<MeasuredPoint> &seen) const;

    bool is_measuring() const { return measuring_ && shown_.model; }
    void toggle_measuring();
    // Adds a point to the line that is measured.
    void add_point(const std::optional<MeasuredPoint> &seen);
    // Takes the last point back, or all.
    void edit(EditKey key);
    // Puts points and distances, if there are any, on the clipboard.
    void copy() const;
    // What a change of the model would lose; empty for nothing.
    std::string losses() const;
    void forget_points() { line_.clear(); }

    bool shows_coordinates() const { return show_coordinates_; }
    void toggle_coordinates() { show_coordinates_ = !show_coordinates_; }

    // No clip region, a plane, a box, none again. A region of the command line gets its handles first.
    void switch_clip();
    // The handle at a pixel, which the mouse then drags.
    std::optional<ClipHandle> handle_at(glm::dvec2 pixel) const;
    void drag_clip(ClipHandle handle, glm::dvec2 pixel);

  private:
    void add_measures(OverlayDrawing &to) const;
    void add_clip_handles(OverlayDrawing &to) const;

    const Shown &shown_;
    Navigator &navigator_;
    Notices &notices_;
    Window &window_;
    bool measuring_ = false, show_coordinates_ = false, show_clip_handles_ = false;
    Polyline line_; // measured
};

} // namespace pbm
