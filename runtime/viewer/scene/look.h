// How a model is drawn: the options, and the user's edits of the file's appearance.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "viewer/options/look_options.h"

#include <memory>

namespace pbm {

struct Look {
    // `up`: of the view that default lights, and lights that follow the eye, are given for. `cue`: of the model where
    // nobody asks for one.
    Look(const LookOptions &look, const ModelParameters &parameters, UpAxis up, DepthCue cue = DepthCue::none,
         bool has_one_colour = false)
        : options(look), appearance(parameters), unasked_cue(cue) {
        appearance.up = up;
        appearance.has_one_colour = has_one_colour;
        if (parameters.lights.empty())
            appearance.lights = default_lights(up);
    }

    // As the options ask, else as the appearance says.
    LightsFollow lights_follow() const { return options.lights_follow.value_or(appearance.lights_follow); }

    DepthCue depth_cue() const { return options.depth_cue.value_or(unasked_cue); }

    LookOptions options;
    Appearance appearance;
    DepthCue unasked_cue;
};

// The appearance that renderers draw the look with: with a headlight, its light is the only one.
Appearance appearance_for(const Look &look);

// The look with lights that follow the model, where those that follow the eye stand for this camera.
Look with_fixed_lights(Look look, const Camera &camera, const Grid &grid);

// Immutable, since pictures drawn in the background share it; a change replaces it.
using LookPointer = std::shared_ptr<const Look>;

} // namespace pbm
