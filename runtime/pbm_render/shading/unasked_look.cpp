#include "pbm_render/shading/unasked_look.h"

namespace pbm {

UnaskedLook unasked_look(const Reader &reader) {
    // Within a text of JSON a quote has a backslash before it, so that these bytes are a key and its value.
    const bool is_cloud = reader.metadata().find("\"uncoloured_cloud\":true") != std::string_view::npos;
    const AttributeSet &set = reader.parameters().attributes;
    if (!is_cloud || set.colour != ColourFormat::none || set.texture || reader.parameters().materials.size() > 1)
        return {};
    return {.colour_by = "height", .depth_cue = DepthCue::eye_dome};
}

} // namespace pbm
