#include "pbm_render/shading/unasked_look.h"

#include <algorithm>

namespace pbm {
namespace {

// Whether the metadata has this key. Within a text of JSON a quote has a backslash before it, so that a quote, a name,
// a quote and a colon are a key.
bool has_key(const Reader &reader, std::string_view key) {
    return reader.metadata().find(key) != std::string_view::npos;
}

} // namespace

UnaskedLook unasked_look(const Reader &reader) {
    const ModelParameters &parameters = reader.parameters();
    const auto surfaces = std::count_if(parameters.materials.begin(), parameters.materials.end(),
                                        [](const Material &material) { return !is_round(material); });
    const bool is_cloud = has_key(reader, "\"uncoloured_cloud\":true");
    if (!is_cloud || parameters.attributes.colour != ColourFormat::none || parameters.attributes.texture ||
        surfaces > 1)
        return {};
    const bool is_on_map = has_key(reader, "\"crs\":") && parameters.grid.up == UpAxis::z;
    return {.colour_by = "height", .depth_cue = DepthCue::eye_dome, .from_above = is_on_map};
}

} // namespace pbm
