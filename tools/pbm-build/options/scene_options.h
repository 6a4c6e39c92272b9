// Options of the scene around a scan: lights, shadows, materials, textures, surroundings.
#pragma once

#include "command_line/parse.h"
#include "pbm_build/scene/scene.h"

#include <string>
#include <vector>

namespace pbm::build {

// Values of these options from the command line or a recipe, before scene_request combines them.
struct SceneArguments {
    std::vector<std::string> lights, materials; // texts
    std::string light_set, ground_material, panorama;
    bool legacy_material = false, environment_map = false, shadows = false;
    std::string texture, ground; // plain, marble, wood; empty: none
    TextureOptions texture_options;
    ShadowRequest shadow_options;
    GroundRequest ground_options;
    PanoramaOptions panorama_options;
    SceneRequest request; // values that need no combination
};

// Joins options with an optional value (--texture, --ground, -TEXTURE, -BACKGROUND) and the next word, if that is a
// kind of texture or the name of an image (by its extension); otherwise adds their default value. -BACKGROUND becomes a
// panorama and a ground plane, as in the dissertation's program; with -TEXTURE a wooden one.
std::vector<std::string> with_optional_values(const std::vector<std::string> &words);

// Adds three topics of help. `arguments` must outlive the parsing.
void add_scene_options(command_line::CommandLine &line, SceneArguments &arguments);

// Combines all options; `line` has been parsed.
//
// errors  usage  an invalid combination, or too many lights or materials
Result<SceneRequest> scene_request(const command_line::CommandLine &line, const SceneArguments &arguments);

} // namespace pbm::build
