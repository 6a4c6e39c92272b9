#include "pbm_render/shading/unasked_look.h"

#include <algorithm>

namespace pbm {

UnaskedLook unasked_look(const Reader &reader) {
    // Within a text of JSON a quote has a backslash before it, so that these bytes are a key and its value.
    const bool is_cloud = reader.metadata().find("\"uncoloured_cloud\":true") != std::string_view::npos;
    const ModelParameters &parameters = reader.parameters();
    const auto surfaces = std::count_if(parameters.materials.begin(), parameters.materials.end(),
                                        [](const Material &material) { return !is_round(material); });
    if (!is_cloud || parameters.attributes.colour != ColourFormat::none || parameters.attributes.texture ||
        surfaces > 1)
        return {};
    return {.colour_by = "height", .depth_cue = DepthCue::eye_dome};
}

} // namespace pbm
