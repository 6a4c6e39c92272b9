// Colours of vertices from their materials.
#pragma once

#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Gives vertices the colours of their materials where some triangles have an image and no vertex has a colour.
inline void colour_beside_images(Surface &surface) {
    if (surface.texture_ids.empty() || !surface.colours.empty())
        return;
    const std::vector<Material> materials = surface.materials.empty() ? std::vector<Material>(1) : surface.materials;
    surface.colours.assign(surface.positions.size(), materials.front().colour);
    for (std::size_t i = 0; i < surface.material_ids.size(); ++i)
        surface.colours[i] = materials[surface.material_ids[i]].colour;
}

} // namespace pbm::build
