#include "pbm_render/appearance/appearance.h"

#include "pbm_render/appearance/shade_table.h"

namespace pbm {

std::optional<StreamInfo> palette_stream(const AttributeSet &set) {
    return set.texture ? std::optional(StreamInfo{StreamKind::texture}) : std::nullopt;
}

Appearance::Appearance(const ModelParameters &parameters) : materials(parameters.materials), lights(parameters.lights) {
    if (lights.empty())
        lights = default_lights(parameters.grid.up);
    if (!parameters.texture.empty())
        palette = parameters.texture.front().palette;
    if (parameters.ground && parameters.ground->texture)
        ground_palette = parameters.ground->texture->palette;
}

} // namespace pbm
