// Lights and materials as options and recipes of pbm-build.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/appearance/appearance.h"

#include <string>
#include <string_view>

namespace pbm {

// The word as a POSIX shell reads it back.
std::string shell_quoted(std::string_view word);

// The value of --light that places this light in a model with this grid. `casts`: whether it casts shadows; no word of
// it if the model has none.
std::string light_as_option(const Light &light, const Grid &grid, std::optional<bool> casts);
// The value of --material: the name of a preset, or all its numbers.
std::string material_as_option(const Material &material);

// Options of pbm-build for the lights (lights_to_keep) and all materials of an appearance, each after a space, quoted
// for a shell. `file` is the model that it belongs to. The sizes of lights are not known: their shadows are hard.
std::string scene_as_options(const Appearance &appearance, const ModelParameters &file);
// The same as a recipe, with the up axis. `name` is that of the model, for its comment.
std::string scene_as_recipe(const Appearance &appearance, const ModelParameters &file, const std::string &name);

} // namespace pbm
