#include "pbm_render/shading/unasked_look.h"

namespace pbm {
namespace {

// Whether the metadata has this key. Within a text of JSON a quote has a backslash before it, so that a quote, a name,
// a quote and a colon are a key.
bool has(const Reader &reader, std::string_view key) { return reader.metadata().find(key) != std::string_view::npos; }

} // namespace

UnaskedLook unasked_look(const Reader &reader) {
    const bool is_cloud = has(reader, "\"uncoloured_cloud\":true");
    const AttributeSet &set = reader.parameters().attributes;
    if (!is_cloud || set.colour != ColourFormat::none || set.texture || reader.parameters().materials.size() > 1)
        return {};
    const bool is_on_map = has(reader, "\"crs\":") && reader.parameters().grid.up == UpAxis::z;
    return {.colour_by = "height", .depth_cue = DepthCue::eye_dome, .from_above = is_on_map};
}

} // namespace pbm
