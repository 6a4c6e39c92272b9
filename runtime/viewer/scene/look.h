// How a model is drawn: the options, and the user's edits of the file's appearance.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/camera/camera.h"
#include "viewer/options/look_options.h"

#include <memory>

namespace pbm {

struct Look {
    // `up`: of the lights where the file has none.
    Look(const LookOptions &look, const ModelParameters &parameters, UpAxis up)
        : options(look), appearance(parameters) {
        if (parameters.lights.empty())
            appearance.lights = default_lights(up);
    }

    LookOptions options;
    Appearance appearance;
};

// The appearance of the look in a picture that `camera` takes: with a headlight, its light is the only one and casts no
// shadow.
Appearance appearance_for(const Look &look, const Camera &camera);

// Immutable, since pictures drawn in the background share it; a change replaces it.
using LookPointer = std::shared_ptr<const Look>;

} // namespace pbm
