// What the window shows. All owners read it; Viewer sets the model and its first look, Navigator the camera and the up
// axis, SceneEdits the look, Pictures the size.
#pragma once

#include "viewer/options/view_options.h"
#include "viewer/pbm-view/measure/picture_space.h"
#include "viewer/scene/shown_model.h"

namespace pbm {

struct Shown {
    ShownModelPointer model{}; // null: none yet
    LookPointer look{};        // while there is a model
    Camera camera{};
    ViewOptions options;         // of the command line, and what the user has changed of the view since
    glm::ivec2 size{0};          // of the picture, pixels; 0 x 0 before the first
    bool is_for_video = false;   // a video of it is made: nothing else changes it
    bool is_recorded = false;    // its frames are drawn at present
    bool is_overwritten = false; // the file was written in place: its last picture stays until it is opened again

    bool has_picture() const { return model && size != glm::ivec2(0); }
    UpAxis up() const { return up_of(options, model->grid()); }
    // What a picture of `from` shows. Needs a model.
    PictureSpace space(const Camera &from) const { return {from, model->grid().edge(), size}; }
    PictureSpace space() const { return space(camera); }
};

} // namespace pbm
