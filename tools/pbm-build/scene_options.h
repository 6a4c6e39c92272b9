// The options of pbm-build that make a scene of a scan: lights, shadows, materials, textures, surroundings.
#pragma once

#include "command_line/command_line.h"
#include "pbm_build/scene/scene.h"

#include <span>
#include <string>
#include <vector>

namespace pbm::command_line {
struct CommandLine;
}

namespace pbm::build {

// Of these options as the command line or a recipe says them, until all are known.
struct SceneArguments {
    std::vector<std::string> lights, materials; // texts
    std::string light_set, ground_material, panorama;
    bool legacy_material = false, environment_map = false, shadows = false;
    std::optional<std::string> texture, ground; // plain, marble, wood
    TextureOptions texture_options;
    ShadowRequest shadow_options;
    GroundRequest ground_options;
    PanoramaOptions panorama_options;
    SceneRequest request; // what needs no second look
};

// The dissertation's switches and what they stand for here.
std::span<const command_line::OldSwitch> scene_switches();

// The command line with words that may or may not take the next one (--texture, --ground, -TEXTURE, -BACKGROUND) in one
// piece with what they take: a kind of texture, the name of an image (by its extension), else what they mean alone.
// -BACKGROUND is a panorama and a ground plane, as in the dissertation's program; with -TEXTURE a wooden one.
std::vector<std::string> with_optional_values(int argc, char **argv);

// Three topics of help; `arguments` must outlive the parsing.
void add_scene_options(command_line::CommandLine &line, SceneArguments &arguments);

// What all options together ask for; `line` has been parsed.
//
// errors  usage  what no option alone shows
Result<SceneRequest> scene_request(const command_line::CommandLine &line, const SceneArguments &arguments);

} // namespace pbm::build
