// How a model is drawn: the options, and the user's edits of the file's appearance.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "viewer/options/look_options.h"

#include <memory>

namespace pbm {

struct Look {
    Look(const LookOptions &look, const ModelParameters &parameters) : options(look), appearance(parameters) {}

    LookOptions options;
    Appearance appearance;
};

// Immutable, since pictures drawn in the background share it; a change replaces it.
using LookPointer = std::shared_ptr<const Look>;

} // namespace pbm
