// How a model is drawn: the switches, and what of its file was edited while looking.
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

// Shared with pictures that are drawn in the background: never changed, replaced by another one.
using LookPointer = std::shared_ptr<const Look>;

} // namespace pbm
